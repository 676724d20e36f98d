"""Six virtual volunteers: a richer physiology than the inference model, measured with acquisition noise.

``python -m swesbi.virtual_cohort data/virtual_volunteers`` regenerates the shipped cohort.
"""

from swesbi.virtual_cohort.acquisition import acquire
from swesbi.virtual_cohort.record import read_true_theta, record
from swesbi.virtual_cohort.settings import ACQUISITION, ACQUISITION_SEED, AcquisitionSettings, EctopicBeat
from swesbi.virtual_cohort.truth import Truth, TruthCurve, simulate_truth, true_curve
from swesbi.virtual_cohort.volunteers import VOLUNTEERS, Volunteer

__all__ = [
    "ACQUISITION",
    "ACQUISITION_SEED",
    "VOLUNTEERS",
    "AcquisitionSettings",
    "EctopicBeat",
    "Truth",
    "TruthCurve",
    "Volunteer",
    "acquire",
    "read_true_theta",
    "record",
    "simulate_truth",
    "true_curve",
]
