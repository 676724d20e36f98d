"""What an answer depends on, a part a step."""

from __future__ import annotations

from pydantic import Field

from swesbi.base.settings import Settings
from swesbi.checks.settings import PredictiveSettings
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.measurement.settings import MeasurementSettings, SummarySettings
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import JointPriorSettings
from swesbi.recording.cohort.clinical import ClinicalErrors, ClinicalRow
from swesbi.recording.settings import ContextRow, RecordingSettings
from swesbi.recording.tables.layout import TableLayout
from swesbi.verdict.settings import UninformativeSettings
from swesbi.verdict.with_null import VerdictSettings


class IngestSettings(Settings):
    """What an observed curve depends on beside the recording: the subject's row, and settings."""

    context: ContextRow
    clinical: ClinicalRow
    recording: RecordingSettings
    measurement: MeasurementSettings
    layout: TableLayout


class ExactPosteriorSettings(Settings):
    """What the exact posterior depends on."""

    model: SpeedModelSettings
    exact: ExactSettings


class PredictiveSpeedsSettings(Settings):
    """What a predictive check depends on."""

    model: SpeedModelSettings
    summary: SummarySettings
    predictive: PredictiveSettings


class PressuresSettings(Settings):
    """What a posterior with pressures depends on."""

    exact_posterior: ExactPosteriorSettings
    clinical: ClinicalErrors


class AnswerSettings(Settings):
    """What posterior, verdict and predictive check of a recording depend on."""

    exact_posterior: ExactPosteriorSettings
    predictive_speeds: PredictiveSpeedsSettings
    verdict: VerdictSettings
    uninformative: UninformativeSettings


class ShownSettings(Settings):
    """What figures and page depend on beside the answer."""

    cohort_title: str
    prior: JointPriorSettings
    difference_step: float
    draws: int


class OneAnswerSettings(AnswerSettings):
    """The same of a subject outside the study, with the tests that only such a subject needs."""

    ingest: IngestSettings
    noise_level: float = Field(gt=0.0, lt=0.5, description="of the test that the noise is that of the others")
    clinical: ClinicalErrors
    shown: ShownSettings
