"""Raw shear wave recordings and context tables, and how they become observed stiffness curves."""

from swesbi.recording.elasticity import youngs_modulus_kpa
from swesbi.recording.ingest import ingest
from swesbi.recording.observation import Observation
from swesbi.recording.problems import Problem, RecordingError
from swesbi.recording.quality import REASONS
from swesbi.recording.reader import read_samples
from swesbi.recording.samples import FAILED_STATUSES, Samples
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.subjects import read_context_rows, read_subjects

__all__ = [
    "FAILED_STATUSES",
    "REASONS",
    "ContextRow",
    "NoiseComponents",
    "Observation",
    "Problem",
    "RecordingError",
    "RecordingSettings",
    "Samples",
    "ingest",
    "read_context_rows",
    "read_samples",
    "read_subjects",
    "youngs_modulus_kpa",
]
