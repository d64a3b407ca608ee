"""Makes the bundled record from the copy that the gtsam package ships.

    pip install gtsam scipy pandas
    python make_data.py

The record is "Plaza 1" of Djugash, Hamner and Roth, "Navigating with Ranging Radios: Five Data Sets with Ground Truth",
J. Field Robotics 26(9), 2009, as carried by GTSAM (BSD-3-Clause, see data/LICENSE.txt). Changes: MATLAB arrays to CSV,
time counted from the first row of truth, numbers rounded far below their noise.
"""

import importlib.util
from pathlib import Path

import pandas as pd
import scipy.io

HERE = Path(__file__).parent


def main() -> None:
    spec = importlib.util.find_spec("gtsam")
    if spec is None or spec.origin is None:
        raise SystemExit("gtsam is not installed: pip install gtsam")
    arrays = scipy.io.loadmat(Path(spec.origin).parent / "Data" / "Plaza1_.mat")
    zero = arrays["GT"][0, 0]
    tables = {
        "groundtruth.csv.gz": ("GT", ["t_s", "x_m", "y_m", "heading_rad"], 5),
        "odometry.csv.gz": ("DR", ["t_s", "ddist_m", "dheading_rad"], 7),
        "ranges.csv.gz": ("TD", ["t_s", "sender_id", "receiver_id", "range_m"], 4),
    }
    for name, (key, columns, digits) in tables.items():
        table = pd.DataFrame(arrays[key], columns=columns)
        table["t_s"] -= zero
        for column in columns:
            if column.endswith("_id"):
                table[column] = table[column].astype(int)
        table.round(dict.fromkeys(columns, digits) | {"t_s": 4}).to_csv(
            HERE / "data" / name, index=False, compression={"method": "gzip", "mtime": 0}
        )
    beacons = pd.DataFrame(arrays["TL"], columns=["beacon_id", "x_m", "y_m"]).astype({"beacon_id": int})
    beacons.round(4).to_csv(HERE / "data" / "beacons.csv", index=False)


if __name__ == "__main__":
    main()
