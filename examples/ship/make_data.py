"""Draws the ship's record again: speeds that change in legs, fixes, and a log whose error depends on the speed."""

from pathlib import Path

import numpy as np
import pandas as pd

STEP, ROWS = 10.0, 2400  # s
SPEEDS, LEGS, ACCELERATION = (3.0, 8.0), (15, 45), 0.01  # m/s, rows, m/s^2


def log_error(speed):
    """What the log reads too much [m/s]; the same at the same speed, every time."""
    return 0.3 * np.sin(2.0 * speed) + 0.02 * (speed - 5.0)


def record(seed: int = 8) -> pd.DataFrame:
    rng = np.random.default_rng(seed)
    speeds, wanted, left = [5.0], 5.0, 0
    for _ in range(ROWS - 1):
        if not left:
            wanted, left = rng.uniform(*SPEEDS), rng.integers(*LEGS)
        left -= 1
        change = np.clip(wanted - speeds[-1], -ACCELERATION * STEP, ACCELERATION * STEP)
        speeds.append(speeds[-1] + change + 0.005 * rng.standard_normal())
    speed = np.array(speeds)
    place = np.concatenate([[0.0], np.cumsum(STEP * (speed[1:] + speed[:-1]) / 2)])
    return pd.DataFrame(
        {
            "t_s": STEP * np.arange(ROWS),
            "fix_m": (place + 2.0 * rng.standard_normal(ROWS)).round(3),
            "log_mps": (speed + log_error(speed) + 0.05 * rng.standard_normal(ROWS)).round(4),
            "place_m": place.round(3),
            "speed_mps": speed.round(4),
        }
    )


if __name__ == "__main__":
    record().to_csv(Path(__file__).parent / "data" / "trip.csv.gz", index=False)
