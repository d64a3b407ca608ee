"""Times this package beside its peers in one run and writes the table: `python benchmarks/bench.py [--out FILE]`.

Every figure is the best of several rounds, the packages taking turns, so that all see the same machine. Ratios matter,
absolute times do not.
"""

from __future__ import annotations

import argparse
import platform
import subprocess
import sys
import time
import warnings
from importlib.metadata import version
from pathlib import Path

warnings.simplefilter("ignore")

import jax  # noqa: E402
from contenders import LACKS, PACKAGES  # noqa: E402
from problems import Problem, attitude, pendulum  # noqa: E402

RUNS, ROWS = 1000, 50
FIRST = """
import time; begin = time.perf_counter()
import warnings; warnings.simplefilter("ignore")
import sys; sys.path.insert(0, {folder!r})
import numpy as np
{body}
print(time.perf_counter() - begin)
"""
FIRST_BODY = {
    "gainful": """
import jax.numpy as jnp, gainful as gf
y = np.sin(np.arange(500) * 0.06)[:, None]
model = gf.discrete_model(lambda x, u, t: jnp.array([x[0] + .02 * x[1], x[1] - .02 * 9.81 * jnp.sin(x[0])]),
                          lambda x, u, t: jnp.sin(x[:1]), states=2, outputs=1, Q=[1e-6, 1e-4], R=1e-2)
gf.run(gf.extended_kalman_filter(), model, gf.make_prior(model, [1., 0.], [.1, .1]),
       gf.make_log(model, np.arange(500) * .02, y)).mean
""",
    "dynamax": """
import jax, jax.numpy as jnp
from dynamax.nonlinear_gaussian_ssm import ParamsNLGSSM, extended_kalman_filter
y = jnp.asarray(np.sin(np.arange(500) * 0.06)[:, None])
p = ParamsNLGSSM(jnp.array([1., 0.]), .01 * jnp.eye(2),
                 lambda x: jnp.array([x[0] + .02 * x[1], x[1] - .02 * 9.81 * jnp.sin(x[0])]),
                 jnp.diag(jnp.array([1e-6, 1e-4])), lambda x: jnp.sin(x[:1]), 1e-2 * jnp.eye(1))
np.asarray(extended_kalman_filter(p, y).filtered_means)
""",
    "cuthbert": """
import jax, jax.numpy as jnp, cuthbert
from cuthbert.gaussian import moments
y = jnp.asarray(np.sin(np.arange(500) * 0.06)[:, None])
q, r = jnp.diag(jnp.array([1e-3, 1e-2])), .1 * jnp.eye(1)
f = lambda x: (jnp.array([x[0] + .02 * x[1], x[1] - .02 * 9.81 * jnp.sin(x[0])]), q)
filt = moments.build_filter(jnp.array([1., 0.]), .1 * jnp.eye(2), lambda s, i: (f, s.mean),
                            lambda s, i: (lambda x: (jnp.sin(x[:1]), r), s.mean, i))
np.asarray(cuthbert.filter(filt, y, filt.init_prepare()).mean)
""",
    "filterpy": """
from filterpy.kalman import ExtendedKalmanFilter
k = ExtendedKalmanFilter(dim_x=2, dim_z=1); k.x = np.array([1., 0.]); k.P *= .01; k.Q = np.diag([1e-6, 1e-4]); k.R *= 1e-2
for y in np.sin(np.arange(500) * 0.06):
    k.F = np.array([[1., .02], [-.02 * 9.81 * np.cos(k.x[0]), 1.]])
    k.x = np.array([k.x[0] + .02 * k.x[1], k.x[1] - .02 * 9.81 * np.sin(k.x[0])]); k.P = k.F @ k.P @ k.F.T + k.Q
    k.update(np.array([y]), lambda x: np.array([[np.cos(x[0]), 0.]]), lambda x: np.sin(x[:1]))
""",
}


def best_of(calls: dict, rounds: int) -> dict[str, float]:
    """Best seconds of each call, after one that compiles; the calls take turns."""
    best = {}
    for name, call in calls.items():
        jax.block_until_ready(call())
        best[name] = float("inf")
    for _ in range(rounds):
        for name, call in calls.items():
            begin = time.perf_counter()
            jax.block_until_ready(call())
            best[name] = min(best[name], time.perf_counter() - begin)
    return best


def first_results(rounds: int = 3) -> dict[str, float]:
    """Seconds from the first import to estimates, each in a process of its own."""
    best: dict[str, float] = {}
    for _ in range(rounds):
        for name, body in FIRST_BODY.items():
            code = FIRST.format(folder=str(Path(__file__).parent), body=body)
            out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
            best[name] = min(best.get(name, float("inf")), float(out.split()[-1]))
    return best


def table_of(problem: Problem, kind: str) -> dict[str, dict[str, float]]:
    """Per measure and package, the time per row (and run) [us]."""
    there = {name: make(problem, kind) for name, make in PACKAGES.items() if (name, kind) not in LACKS}
    rows = len(problem.y)
    batch = best_of({name: part.batch() for name, part in there.items()}, 7)
    calls = {name: part.many(RUNS, ROWS) for name, part in there.items()}
    many = best_of({name: call for name, call in calls.items() if call is not None}, 3)
    pushes = {name: part.live() for name, part in there.items()}
    streams = {name: lambda push=push: [push() for _ in range(50)] for name, push in pushes.items()}
    live = {name: seconds / 50 for name, seconds in best_of(streams, 40).items()}
    return {
        "one record, per row": {name: 1e6 * s / (200 if name == "filterpy" else rows) for name, s in batch.items()},
        f"{RUNS} records, per row": {name: 1e6 * s / RUNS / ROWS for name, s in many.items()},
        "live, per sample": {name: 1e6 * s for name, s in live.items()},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="also write the table here")
    out = parser.parse_args().out
    names = list(PACKAGES)
    packages = ", ".join(f"{name} {version(name)}" for name in (*names, "jax", "numpy"))
    lines = [f"{packages}; {platform.machine()}, Python {platform.python_version()}.", ""]
    lines += ["| measure | " + " | ".join(names) + " | fastest JAX peer / gainful |", "|---" * (len(names) + 2) + "|"]

    def add(label: str, times: dict[str, float], unit: str) -> None:
        cells = [f"{times[name]:.3g} {unit}" if name in times else "-" for name in names]
        peers = [times[name] for name in ("dynamax", "cuthbert") if name in times]
        ratio = min(peers) / times["gainful"]
        lines.append(f"| {label} | " + " | ".join(cells) + f" | {ratio:.2f} |")
        print(lines[-1], flush=True)

    print("\n".join(lines), flush=True)
    add("first result: import to estimates of 500 rows", first_results(), "s")
    for problem in (pendulum(), attitude()):
        for kind in ("EKF", "UKF"):
            for measure, times in table_of(problem, kind).items():
                add(f"{problem.name}, {kind}: {measure}", times, "us")
    if out is not None:
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
