"""What an installation without the extra `study` lacks: it answers recordings, and trains nothing."""

from __future__ import annotations

from typing import Final

STUDY: Final = ("cma", "nflows", "sbi", "snakemake", "torch", "zuko")
"""Modules that the extra `study` brings, as pyproject.toml lists them."""


def missing(error: ModuleNotFoundError) -> ModuleNotFoundError:
    """Return the error that names the extra, where this is what the missing module comes with."""
    module = (error.name or "").partition(".")[0]
    if module not in STUDY:
        return error
    return ModuleNotFoundError(
        f"{module} is not installed; it comes with the extra `study`: pip install 'swesbi[study]', or "
        "`make install` in a checkout",
        name=module,
    )
