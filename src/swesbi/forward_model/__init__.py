"""The forward model: a spherical left ventricle in a circulation, from theta to one periodic beat."""

from swesbi.forward_model.beats import ActiveBeats, Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import THETA_RANGES, simulate, simulate_active

__all__ = [
    "THETA_RANGES",
    "ActiveBeats",
    "Beats",
    "ForwardModelSettings",
    "Status",
    "simulate",
    "simulate_active",
]
