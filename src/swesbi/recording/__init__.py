"""Raw shear wave recordings and context tables, and how they become observed stiffness curves."""

from swesbi.recording.ingest import ingest, youngs_modulus_kpa
from swesbi.recording.observation import Observation
from swesbi.recording.quality import REASONS
from swesbi.recording.reader import read_context_rows, read_samples, read_subjects
from swesbi.recording.samples import FAILED_STATUSES, RecordingError, Samples
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.speed import NoiseComponents

__all__ = [
    "FAILED_STATUSES",
    "REASONS",
    "ContextRow",
    "NoiseComponents",
    "Observation",
    "RecordingError",
    "RecordingSettings",
    "Samples",
    "ingest",
    "read_context_rows",
    "read_samples",
    "read_subjects",
    "youngs_modulus_kpa",
]
