"""Makes the bundled record: a vehicle's yaw, simulated, with two noisy gyros and one noisy torque.

    python make_data.py

The vehicle has the inertia and drag that Wu (2018, Flinders University) found for a BlueROV2 in yaw, and turns to and fro along
a modified Fourier series of 8 s. Nothing in it was recorded.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from gainful.plants import fourier_excitation, published_vehicle

COSINES = (-0.005, 0.06, -0.105, 0.09, 0.325)  # rad/s
SINES = (-0.035, 0.265, -0.065, -0.185, -0.03)  # rad/s
PERIOD, DT, ROWS = 8.0, 0.05, 2000  # s, s
GYRO, TORQUE = 0.05, 0.05  # rad/s, N m; standard deviations


def main() -> None:
    rng, t = np.random.default_rng(4), DT * np.arange(ROWS)
    _, rate, acceleration = fourier_excitation(COSINES, SINES, PERIOD, t)
    torque = np.asarray(published_vehicle("bluerov2_yaw").wrench(acceleration, rate))
    gyros = np.degrees(np.asarray(rate)[:, None] + GYRO * rng.standard_normal((ROWS, 2)))
    columns = {"gyro_a_deg_s": gyros[:, 0], "gyro_b_deg_s": gyros[:, 1]}
    table = pd.DataFrame({"t_s": t, **columns, "torque_nm": torque + TORQUE * rng.standard_normal(ROWS)})
    path = Path(__file__).parent / "data" / "yaw.csv.gz"
    table.round({"t_s": 3, "gyro_a_deg_s": 3, "gyro_b_deg_s": 3, "torque_nm": 4}).to_csv(
        path, index=False, compression={"method": "gzip", "mtime": 0}
    )


if __name__ == "__main__":
    main()
