"""Makes the bundled excerpt from the day file that the gbmgeometry package ships.

    pip install gbmgeometry astropy scipy pandas
    python make_data.py

The record is NASA's Fermi GBM position history `glg_poshist_all_151013_v00.fit` (public domain). The excerpt is its first
hour: attitude quaternion (body to J2000, scalar last) and body rates at 1 Hz as logged, and beside them quaternions made
noisy like a coarse star tracker's: rotated in body axes by Gaussian angles of 30 arcseconds per axis, seed 20151013.
"""

import importlib.util
from pathlib import Path

import numpy as np
import pandas as pd
from astropy.io import fits
from scipy.spatial.transform import Rotation

HERE = Path(__file__).parent
ROWS = 3600
SIGMA_ARCSEC = 30.0
SEED = 20151013


def main() -> None:
    spec = importlib.util.find_spec("gbmgeometry")
    if spec is None or spec.origin is None:
        raise SystemExit("gbmgeometry is not installed: pip install gbmgeometry")
    path = Path(spec.origin).parent / "data" / "glg_poshist_all_151013_v00.fit"
    rows = fits.open(path)["GLAST POS HIST"].data[:ROWS]
    t = rows["SCLK_UTC"].astype(float)
    logged = np.stack([rows[f"QSJ_{k}"].astype(float) for k in (1, 2, 3, 4)], axis=1)
    rates = np.stack([rows[f"WSJ_{k}"].astype(float) for k in (1, 2, 3)], axis=1)
    sigma = np.radians(SIGMA_ARCSEC / 3600)  # rad
    turn = Rotation.from_rotvec(np.random.default_rng(SEED).normal(scale=sigma, size=(ROWS, 3)))
    noisy = (Rotation.from_quat(logged) * turn).as_quat()
    table = pd.DataFrame({"t_s": (t - t[0]).round(3)})
    for name, values in (("q", logged), ("tracker_q", noisy)):
        for k in range(4):
            table[f"{name}{k + 1}"] = values[:, k].round(9)
    for k, axis in enumerate("xyz"):
        table[f"w{axis}_radps"] = rates[:, k].round(10)
    table.to_csv(HERE / "data" / "fermi.csv.gz", index=False, compression={"method": "gzip", "mtime": 0})


if __name__ == "__main__":
    main()
