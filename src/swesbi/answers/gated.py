"""A gated recording under a model: what its phases allow to be inferred, tested and shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from swesbi.answers.kept import Kept, Shown
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.settings import AnswerSettings
from swesbi.artefacts import to_groups
from swesbi.artefacts.files import hdf5_provenance
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.checks.draws import CheckedFeatures
from swesbi.checks.predictive import KIND as PREDICTIVE
from swesbi.checks.predictive import to_datasets
from swesbi.checks.predictive_speeds import Recorder, new_recordings, predictive_check, stream_of
from swesbi.heart.simulate import Beats
from swesbi.measurement.clinical import ClinicalModel, with_pressures
from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.flow.flow import FlowProposal
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.recording.noise import NoiseComparison
from swesbi.recording.observation import KIND, Observation, read_observation, same_recording
from swesbi.recording.speed import NoiseComponents
from swesbi.report.figures.predictive import PredictivePanel, draw_subject_check
from swesbi.report.sheet import curve_gated, recorded_gated
from swesbi.verdict.verdict import Verdict, VerdictTest
from swesbi.verdict.with_null import judge, network_test


@dataclass(frozen=True)
class GatedRecording:
    """A recording at gated phases under the model of an experiment.

    Attributes:
        observation: The observed curve.
        model: Its likelihood, with the standard errors that its noise gives.
        tests: Of the recording alone, which can strain the subject: that of its noise.
        noise: From which noise its standard errors are estimated, in words.
        stream: Begins the names of the random streams of its answer.
    """

    observation: Observation
    model: SpeedModel
    tests: tuple[VerdictTest, ...] = ()
    noise: str = ""
    stream: str = "new subject"

    @property
    def cells(self) -> IntArray:
        """Cell of each speed, within which the model has one error: of each phase its own."""
        return np.arange(len(self.model.recording.phase))

    @property
    def speeds(self) -> SpeedModel:
        """What simulates the subject and predicts its speeds."""
        return self.model

    def proposal(self, knowledge: Knowledge) -> FlowProposal | None:
        """Return the posterior of a network with which the inference begins; None: the prior."""
        return knowledge.of_phases(self.model.recording)

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
            raise ValueError("a gated recording is judged by null distributions, and none are given")
        further = (*self.tests, *(() if knowledge.flow is None else (network_test(efficiency),)))
        nulls, rule, clinical = knowledge.nulls, settings.verdict, self.observation.clinical
        return judge(exact, self.model, beats, nulls, knowledge.hearts, rule, seed, clinical, further)

    def with_pressures(self, settings: ClinicalErrors) -> ClinicalModel | None:
        """Return the model with the pressures of a cuff; None where none were taken.

        Raises:
            ValueError: The prior or the circulation has no place for them.
        """
        clinical = self.observation.clinical
        return with_pressures(self.model, clinical, settings) if clinical.has_pressures else None

    def observed(self) -> Kept:
        """Return what ``observation.h5`` holds."""
        return Kept(KIND, to_groups(self.observation))

    def is_kept_in(self, path: Path) -> bool:
        """Tell whether an artefact is the observed curve of this recording."""
        return hdf5_provenance(path).kind == KIND and same_recording(read_observation(path), self.observation)

    def checked(
        self,
        exact: ExactPosterior,
        prior: FloatArray,
        verdict: Verdict,
        settings: AnswerSettings,
        seed: int,
    ) -> Shown:
        """Compare the recording with what prior and posterior predict of new ones."""
        predictive, model = settings.predictive_speeds.predictive, self.model
        features = CheckedFeatures(predictive.features, settings.predictive_speeds.summary)
        recorder, readable = Recorder(model, self.observation, features), verdict.may_be_read
        before = new_recordings(prior, recorder, stream_of(recorder, seed, "prior"))
        check = predictive_check(recorder, exact.phi, before, predictive, seed, may_be_read=readable)
        panel = PredictivePanel(self.observation.subject, check, None, verdict)
        return Shown(
            kept=Kept(PREDICTIVE, to_datasets(check)),
            draw=partial(draw_subject_check, panel),
            recorded=recorded_gated(self.observation),
            curve=curve_gated(check),
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
