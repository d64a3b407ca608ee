"""What importing the package changes in the process, and what it leaves alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

SHOW = """
import json, os, gainful, jax
print(json.dumps([os.environ.get("XLA_FLAGS", ""), jax.config.read("jax_cpu_enable_async_dispatch"),
                  jax.config.read("jax_enable_x64")]))
"""
SETTINGS = ("XLA_FLAGS", "JAX_CPU_ENABLE_ASYNC_DISPATCH", "GAINFUL_X64")


def _after_import(**settings: str) -> list:
    kept = {name: value for name, value in os.environ.items() if name not in SETTINGS}
    out = subprocess.run([sys.executable, "-c", SHOW], env=kept | settings, capture_output=True, text=True, check=True)
    return json.loads(out.stdout)


def test_small_loops_are_compiled_whole_and_calls_made_at_once_in_64_bits():
    flags, asynchronous, wide = _after_import()
    assert "xla_cpu_small_while_loop_byte_threshold" in flags
    assert (asynchronous, wide) == (False, True)


@pytest.mark.parametrize("own", ["--xla_backend_extra_options=xla_cpu_disable_loop_unrolling=true"])
def test_what_the_environment_says_is_left_alone(own):
    assert _after_import(XLA_FLAGS=own, JAX_CPU_ENABLE_ASYNC_DISPATCH="1", GAINFUL_X64="0") == [own, True, False]


def test_other_flags_are_kept():
    flags, _, _ = _after_import(XLA_FLAGS="--xla_cpu_enable_fast_math=false")
    assert flags.startswith("--xla_cpu_enable_fast_math=false --xla_backend_extra_options=")
