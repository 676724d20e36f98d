"""swesbi: simulation-based inference of cardiac mechanics from shear wave elastography."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swesbi.context import Context
    from swesbi.interface import Recording, infer, read_recording, sample_posterior, simulate_beat
    from swesbi.networks.torch_prior import torch_prior
    from swesbi.prior import ParameterPrior

__version__ = "0.1.0"
__all__ = [
    "Context",
    "ParameterPrior",
    "Recording",
    "infer",
    "read_recording",
    "sample_posterior",
    "simulate_beat",
    "torch_prior",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Load a public name when it is first asked for: a beat needs no torch."""
    if name == "torch_prior":
        try:
            from swesbi.networks.torch_prior import torch_prior
        except ModuleNotFoundError as error:
            from swesbi.base.extras import missing

            raise missing(error) from None
        return torch_prior
    if name in __all__:
        from swesbi import interface

        return getattr(interface, name)
    raise AttributeError(f"module 'swesbi' has no attribute {name!r}")
