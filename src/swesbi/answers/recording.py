"""A recording under a model, and the test of its own noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import measured_speeds
from swesbi.recording.noise.cohort import NoiseComparison
from swesbi.recording.observation import SOURCES, Observation
from swesbi.recording.speed import NoiseComponents
from swesbi.verdict.verdict import VerdictTest


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

    @property
    def has_pressures(self) -> bool:
        """Whether the pressures of a cuff can inform its posterior; those of pushes do not."""
        return self.observation.is_gated and self.observation.clinical.has_pressures


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
    if comparison is None or np.isnan(comparison.p_value):
        why = f"the recording alone does not tell its noise, and that of {whose} is used"
        if comparison is None:
            why = "no other recording of the same kind is in the folder"
        return VerdictTest("noise", 0.0, None, level, flagged=False, detail=f"not tested: {why}")
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
