"""Simulation-based inference of cardiac mechanics from shear wave elastography.

Ten names are public:

    read_recording         read FOLDER/swe/SUBJECT.csv, or a subject of FOLDER
    recording_from_table   a recording in a pandas DataFrame
    recording_from_arrays  a free-running recording in arrays
    Recording              a recording under the model: prior, likelihood, predictions
    infer                  exact posterior and verdict of a recording
    simulate_beat          the periodic beat of a heart
    Context                sex, age, body surface area, heart rate, volumes, septum
    ParameterPrior         a log-normal between bounds
    torch_prior            a prior as a torch distribution
    sample_posterior       exact posterior of a model of your own

Each is loaded when it is first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swesbi.context import Context
    from swesbi.interface import (
        Recording,
        infer,
        read_recording,
        recording_from_arrays,
        recording_from_table,
        sample_posterior,
        simulate_beat,
        torch_prior,
    )
    from swesbi.parameters import ParameterPrior

__version__ = "0.2.0"
__all__ = [
    "Context",
    "ParameterPrior",
    "Recording",
    "infer",
    "read_recording",
    "recording_from_arrays",
    "recording_from_table",
    "sample_posterior",
    "simulate_beat",
    "torch_prior",
]


def __dir__() -> list[str]:
    """List the public names before they are loaded, for ``help`` and completion."""
    return [*__all__, "__version__"]


def __getattr__(name: str) -> Any:  # noqa: ANN401
    """Load a public name when it is first asked for: the start of a command waits for none."""
    if name in __all__:
        from swesbi import interface

        return getattr(interface, name)
    raise AttributeError(f"module 'swesbi' has no attribute {name!r}")
