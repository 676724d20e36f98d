"""The forward model: a spherical left ventricle in a circulation, from theta to one periodic beat."""

from swesbi.forward_model.beats import Beats
from swesbi.forward_model.periodic import Status
from swesbi.forward_model.settings import ForwardModelSettings
from swesbi.forward_model.simulate import THETA_RANGES, simulate

__all__ = ["THETA_RANGES", "Beats", "ForwardModelSettings", "Status", "simulate"]
