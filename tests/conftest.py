"""What every test shares: reproducible seeds, a cache of compiled programs, and how much of the product of parts to try."""

import os
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

# Compiling is most of the run time: without optimisation it takes a third, and last digits differ.
os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} --xla_backend_optimization_level=0".strip()

import hypothesis
import jax
import numpy as np
import pytest
from provoked import Provoked

import gainful  # noqa: F401  # switches 64-bit numbers on before anything is traced
from gainful.running import compiled


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--full", action="store_true", help="every combination of parts, not only a set in which every pair occurs"
    )
    parser.addoption("--seed", type=int, default=0, help="another number draws other random problems")


def pytest_configure(config: pytest.Config) -> None:
    config.pluginmanager.register(Provoked())
    if hasattr(config, "cache"):  # absent under -p no:cacheprovider
        # Programs that take long to compile are kept for the next run.
        jax.config.update("jax_compilation_cache_dir", str(config.cache.mkdir("jax")))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.3)
    # Derandomised: the same examples each time, so that a red test is red for everybody.
    phases = [hypothesis.Phase.explicit, hypothesis.Phase.generate, hypothesis.Phase.shrink]
    shared = hypothesis.settings(deadline=None, database=None, phases=phases)
    hypothesis.settings.register_profile("default", shared, max_examples=25, derandomize=True)
    hypothesis.settings.register_profile("full", shared, max_examples=500, print_blob=True)
    hypothesis.settings.load_profile("full" if config.getoption("--full") else "default")


@pytest.fixture(scope="session")
def generator(request: pytest.FixtureRequest) -> Callable[[str], np.random.Generator]:
    """Random numbers by name, the same in every run unless `--seed` says otherwise."""
    return lambda name: np.random.default_rng(zlib.crc32(name.encode()) ^ request.config.getoption("--seed"))


@pytest.fixture
def rng(request: pytest.FixtureRequest, generator: Callable[[str], np.random.Generator]) -> np.random.Generator:
    """Random numbers of this test's own."""
    return generator(request.node.nodeid)


@pytest.fixture
def key(rng: np.random.Generator) -> jax.Array:
    """A JAX key of this test's own."""
    return jax.random.key(int(rng.integers(2**31)))


MAPPED = 20_000
"""Pieces of memory a process may have mapped before it lets go of its programs: a third of what Linux grants."""


@pytest.fixture(autouse=True, scope="module")
def room_for_programs() -> Iterator[None]:
    """Compiled programs are let go of between files: each maps memory, and the compiler does not survive the system's limit."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MAPPED:
        compiled.forget_programs()


@pytest.fixture
def as_users_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs are compiled with optimisation, which tests of last digits ask for."""
    plain = compiled.compiler_options
    monkeypatch.setattr(compiled, "_executables", {})
    monkeypatch.setattr(
        compiled, "compiler_options", lambda **asked: plain(**asked) | {"xla_backend_optimization_level": 3}
    )
