"""What an answer depends on."""

from __future__ import annotations

from pydantic import Field

from swesbi.checks.settings import PredictiveSettings
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalRow
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.tables.layout import TableLayout
from swesbi.verdict.recording import VerdictSettings
from swesbi.verdict.settings import UninformativeSettings


class AnswerSettings(VerdictSettings):
    """What posterior, verdict and predictive check of a recording depend on."""

    exact: ExactSettings
    summary: SummarySettings
    predictive: PredictiveSettings
    uninformative: UninformativeSettings


class OneAnswerSettings(AnswerSettings):
    """The same of a subject outside the study: its row, its recording, tests and figures of its own."""

    context: ContextRow
    clinical_row: ClinicalRow
    recording: RecordingSettings
    measurement: MeasurementSettings
    layout: TableLayout
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is that of the others")
    clinical: ClinicalErrors
    cohort_title: str
    joint_prior: JointPriorSettings
    difference_step: float
    repeats_draws: int
