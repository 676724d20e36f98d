"""A recording under a model: what it allows to be inferred, tested and shown, whatever its points are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swesbi.answers.knowledge import Knowledge
from swesbi.answers.output import PredictiveOutput
from swesbi.answers.settings import AnswerSettings
from swesbi.artefacts.files import hdf5_provenance
from swesbi.base.arrays import FloatArray
from swesbi.checks.draws import CheckedFeatures
from swesbi.checks.free_predictive import FreePredictiveCheck, check_pushes
from swesbi.checks.predictive import PredictiveCheck
from swesbi.checks.predictive_speeds import Recorder, new_recordings, predictive_check, stream_of
from swesbi.heart.simulate import Beats
from swesbi.measurement.clinical import ClinicalModel, with_pressures
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.recording.noise.cohort import NoiseComparison
from swesbi.recording.observation import SOURCES, Observation, same_recording
from swesbi.recording.speed import NoiseComponents
from swesbi.report.sheet import curve_free, curve_gated, recorded_free, recorded_gated
from swesbi.seeds import generator
from swesbi.verdict.recording import judge, network_test
from swesbi.verdict.verdict import Verdict, VerdictTest

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ModelledRecording:
    """Gated phases, or pushes at instants of their own, under the model of an experiment.

    Attributes:
        observation: What was observed.
        model: Its likelihood, with the standard errors that its noise gives.
        tests: Of the recording alone, which can make the subject doubtful: that of its noise.
        noise: From which noise its standard errors are estimated, in words.
        stream: Begins the names of the random streams of its answer.
    """

    observation: Observation
    model: SpeedModel
    tests: tuple[VerdictTest, ...] = ()
    noise: str = ""
    stream: str = "new subject"

    def judged(
        self,
        exact: ExactPosterior,
        beats: Beats,
        efficiency: Sequence[float],
        knowledge: Knowledge,
        settings: AnswerSettings,
        seed: int,
    ) -> Verdict:
        """Judge the recording by null distributions, volumes, ejection, context and its own noise.

        Raises:
            ValueError: The knowledge has no null distributions.
        """
        if knowledge.nulls is None:
            raise ValueError("a recording is judged by null distributions, and none are given")
        further = (*self.tests, *(() if knowledge.flow is None else (network_test(efficiency),)))
        nulls, rule, clinical = knowledge.nulls, settings, self.observation.clinical
        return judge(exact, self.model, beats, nulls, knowledge.hearts, rule, seed, clinical, further)

    def with_pressures(self, settings: ClinicalErrors) -> ClinicalModel | None:
        """Return the model with the pressures of a cuff; None where none were taken, and of pushes.

        Raises:
            ValueError: The prior or the circulation has no place for them.
        """
        clinical = self.observation.clinical
        if not self.observation.is_gated or not clinical.has_pressures:
            return None
        return with_pressures(self.model, clinical, settings)

    def is_kept_in(self, path: Path) -> bool:
        """Tell whether an artefact is the observation of this recording."""
        is_observation = hdf5_provenance(path).kind == Observation.kind
        return is_observation and same_recording(Observation.read(path), self.observation)

    def checked(
        self,
        exact: ExactPosterior,
        prior: FloatArray,
        verdict: Verdict,
        settings: AnswerSettings,
        seed: int,
    ) -> PredictiveOutput:
        """Compare the recording with what prior and posterior predict of new ones."""
        predictive, subject = settings.predictive, self.observation.subject
        if not self.observation.is_gated:
            points = self.model.settings.measurement.grid_points
            rng, draws = generator(seed, self.stream, subject, "new pushes"), exact.phi[: predictive.draws]
            pushes = check_pushes(self.model, draws, prior, predictive.interval, points, rng)
            errors = SOURCES[self.observation.errors_from]
            return PredictiveOutput(
                check=pushes,
                draw=partial(_draw_pushes, subject, pushes, verdict, errors),
                recorded=recorded_free(self.observation),
                curve=curve_free(pushes),
            )
        features = CheckedFeatures(predictive.features, settings.summary)
        recorder, readable = Recorder(self.model, self.observation, features), verdict.may_be_read
        before = new_recordings(prior, recorder, stream_of(recorder, seed, "prior"))
        check = predictive_check(recorder, exact.phi, before, predictive, seed, may_be_read=readable)
        return PredictiveOutput(
            check=check,
            draw=partial(_draw_gated, subject, check, verdict),
            recorded=recorded_gated(self.observation),
            curve=curve_gated(check),
        )


def _draw_pushes(
    subject: str, check: FreePredictiveCheck, verdict: Verdict, errors: str, title: str
) -> Figure:
    # half a second to import, of which a job that writes the check needs nothing
    from swesbi.report.figures.free_predictive import draw_free_check

    return draw_free_check(subject, check, verdict, errors, title)


def _draw_gated(subject: str, check: PredictiveCheck, verdict: Verdict, title: str) -> Figure:
    from swesbi.report.figures.predictive import PredictivePanel, draw_subject_check

    return draw_subject_check(PredictivePanel(subject, check, None, verdict), title)


def modelled_pushes(observed: Observation, settings: SpeedModelSettings) -> ModelledRecording:
    """Return pushes under a model, with the errors that their table or its description states."""
    median = 100.0 * float(np.median(observed.relative_se))
    noise = f"{SOURCES[observed.errors_from]}, {median:.1f} % in the median"
    return ModelledRecording(
        observed, SpeedModel(measured_speeds(observed), settings), (), noise, "free subject"
    )


def noise_test(
    comparison: NoiseComparison | None, noise: NoiseComponents, whose: str, level: float
) -> VerdictTest:
    """Return the test that a recording has the noise from which its standard errors are estimated.

    Args:
        comparison: Of the recording with others; None where there are none.
        noise: Their components.
        whose: What they are of ("the cohort", "the folder").
        level: Of the test.
    """
    if comparison is None:
        why = "not tested: no other recording of the same kind is in the folder"
        return VerdictTest("noise", 0.0, None, level, flagged=False, detail=why)
    if np.isnan(comparison.p_value):
        why = f"not tested: the recording alone does not tell its noise, and that of {whose} is used"
        return VerdictTest("noise", 0.0, None, level, flagged=False, detail=why)
    return VerdictTest(
        name="noise",
        statistic=comparison.statistic,
        p_value=comparison.p_value,
        threshold=level,
        flagged=comparison.p_value <= level,
        detail=_noise_in_words(comparison.own, noise, whose),
    )


def _noise_in_words(own: NoiseComponents, noise: NoiseComponents, whose: str) -> str:
    words = (
        f"{own.repeat_fraction:.1%} between repeats and {own.sample_fraction:.1%} between samples; "
        f"{whose} has {noise.repeat_fraction:.1%} and {noise.sample_fraction:.1%}"
    )
    if own.sweep_fraction or noise.sweep_fraction:
        words += f"; {own.sweep_fraction:.1%} between sweeps, {noise.sweep_fraction:.1%} in {whose}"
    return words
