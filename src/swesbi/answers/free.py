"""A free-running recording under a model: what its pushes allow to be inferred, tested and shown."""

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
from swesbi.checks.free_predictive import KIND as PREDICTIVE
from swesbi.checks.free_predictive import check_pushes
from swesbi.heart.simulate import Beats
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.likelihood import SpeedModel
from swesbi.networks.flow.flow import FlowProposal
from swesbi.posterior.result import ExactPosterior
from swesbi.recording.cohort.clinical import ClinicalErrors
from swesbi.recording.free_noise import SOURCES
from swesbi.recording.free_observation import (
    KIND,
    FreeObservation,
    read_free_observation,
    same_free_recording,
)
from swesbi.report.figures.free_predictive import draw_free_check
from swesbi.report.sheet import curve_free, recorded_free
from swesbi.seeds import generator
from swesbi.verdict.verdict import Verdict, VerdictTest
from swesbi.verdict.with_null import judge, network_test


@dataclass(frozen=True)
class FreeRecording:
    """Pushes at instants of their own under the model of an experiment.

    Attributes:
        observation: The accepted pushes.
        model: Their likelihood.
        tests: Of the recording alone, which can strain the subject.
        stream: Begins the names of the random streams of its answer.
    """

    observation: FreeObservation
    model: FreeModel
    tests: tuple[VerdictTest, ...] = ()
    stream: str = "free subject"

    @property
    def noise(self) -> str:
        """From what its errors are estimated, in words."""
        median = 100.0 * float(np.median(self.observation.relative_se))
        return f"{SOURCES[self.observation.noise_source]}, {median:.1f} % in the median"

    @property
    def cells(self) -> IntArray:
        """Cell of each speed, within which the model has one error."""
        return self.model.cell

    @property
    def speeds(self) -> SpeedModel:
        """What simulates the subject and predicts its speeds."""
        return self.model.model

    def proposal(self, knowledge: Knowledge) -> FlowProposal | None:
        """Return the posterior of a network with which the inference begins; None: the prior.

        Raises:
            ValueError: The network takes no pushes.
        """
        return knowledge.of_pushes(self.model)

    def judged(
        self,
        exact: ExactPosterior,
        beats: Beats,
        efficiency: Sequence[float],
        knowledge: Knowledge,
        settings: AnswerSettings,
        seed: int,
    ) -> Verdict:
        """Judge the recording by null distributions, volumes, ejection and context.

        Raises:
            ValueError: The knowledge has no null distributions of pushes.
        """
        if knowledge.nulls is None:
            raise ValueError("a free-running recording is judged by null distributions, and none are given")
        further = (*self.tests, *(() if knowledge.flow is None else (network_test(efficiency),)))
        nulls, rule, clinical = knowledge.nulls, settings.verdict, self.observation.clinical
        return judge(exact, self.model, beats, nulls, knowledge.hearts, rule, seed, clinical, further)

    def with_pressures(self, settings: ClinicalErrors) -> None:
        """Return None: with pushes, pressures have no model yet."""

    def observed(self) -> Kept:
        """Return what ``observation.h5`` holds."""
        return Kept(KIND, to_groups(self.observation))

    def is_kept_in(self, path: Path) -> bool:
        """Tell whether an artefact holds the pushes of this recording."""
        kept = hdf5_provenance(path).kind == KIND
        return kept and same_free_recording(read_free_observation(path), self.observation)

    def checked(
        self,
        exact: ExactPosterior,
        prior: FloatArray,
        verdict: Verdict,
        settings: AnswerSettings,
        seed: int,
    ) -> Shown:
        """Compare the recording with new pushes at its instants, by draws of the posterior and the prior."""
        predictive, subject = settings.predictive_speeds.predictive, self.observation.subject
        points = self.model.settings.measurement.grid_points
        rng = generator(seed, self.stream, subject, "new pushes")
        draws = exact.phi[: predictive.draws]
        check = check_pushes(self.model, draws, prior, predictive.interval, points, rng)
        errors = SOURCES[self.observation.noise_source]
        return Shown(
            kept=Kept(PREDICTIVE, to_groups(check)),
            draw=partial(draw_free_check, subject, check, verdict, errors),
            recorded=recorded_free(self.observation),
            curve=curve_free(check),
        )
