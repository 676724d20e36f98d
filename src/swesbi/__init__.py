"""swesbi: simulation-based inference of cardiac mechanics from shear wave elastography."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

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
FROM: Final = {
    "Context": "swesbi.context",
    "ParameterPrior": "swesbi.prior",
    "torch_prior": "swesbi.networks.torch_prior",
}


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Load a public name when it is first asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'swesbi' has no attribute {name!r}")
    return getattr(import_module(FROM.get(name, "swesbi.interface")), name)
