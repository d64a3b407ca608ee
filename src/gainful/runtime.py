"""What JAX is told before it starts."""

from __future__ import annotations

import functools
import os

_LOOP_LIMIT = 1 << 20
"""Bytes one turn of a loop may touch for the loop to be compiled into one function."""
_OPTION = "xla_cpu_small_while_loop_byte_threshold"


def prepare() -> None:
    """Compute in 64 bits unless `GAINFUL_X64=0`, have small loops compiled whole and small calls made at once.

    XLA on a CPU otherwise starts every operation of every turn of a loop by itself, which costs a small filter ten times
    what its arithmetic does, and hands each call to another thread, which costs a live step as much again. What the
    environment already says (`XLA_FLAGS` with backend options, `JAX_CPU_ENABLE_ASYNC_DISPATCH`) is left as it is, and a
    JAX that has already computed something hears neither.
    """
    import jax

    if os.environ.get("GAINFUL_X64", "1") != "0":
        jax.config.update("jax_enable_x64", True)
    if "JAX_CPU_ENABLE_ASYNC_DISPATCH" not in os.environ:
        jax.config.update("jax_cpu_enable_async_dispatch", False)
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} --xla_backend_extra_options={_OPTION}={_LOOP_LIMIT}".strip()


@functools.cache
def compiler_options(*, quick: bool = False) -> dict[str, str | int]:
    """What a program of small loops is compiled with: products stay in the loop, where XLA knows how to be told so.

    Args:
        quick: leave it unoptimised, which is what takes the compiler its time.
    """
    wanted: list[dict[str, str | int]] = [{"xla_cpu_experimental_ynn_fusion_type": ""}]
    if quick:
        wanted.append({"xla_backend_optimization_level": 0})
    return {name: value for option in wanted if _known(option) for name, value in option.items()}


def _known(options: dict[str, str | int]) -> bool:
    """Whether this XLA knows an option: one of another version may not, or may lack the library it is about."""
    import jax

    try:
        jax.jit(lambda x: x, compiler_options=options).lower(0.0).compile()
    except (RuntimeError, ValueError):
        return False
    return True
