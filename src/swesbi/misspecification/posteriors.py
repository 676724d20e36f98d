"""Exact posteriors of many recordings for the tests: importance weights, and what the draws predict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from swesbi.exact.importance import WeightedDraws, weigh
from swesbi.exact.proposal import flow_proposal
from swesbi.flow.conditioning import ConditioningSettings
from swesbi.flow.net import TrainedFlow
from swesbi.misspecification.checks import Checks, PosteriorDraws, check_recording, stack_checks
from swesbi.misspecification.settings import SyntheticSettings
from swesbi.progress import Progress
from swesbi.seeds import generator, integer_seed
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.prediction import PredictedSpeeds
from swesbi.speed_model.recording import SpeedRecording
from swesbi.speed_model.remembering import RememberingModel


class WeighingSettings(Protocol):
    """How many draws are weighted."""

    @property
    def draws(self) -> int:
        """Weighted draws."""

    @property
    def prior_fraction(self) -> float:
        """Share of them from the prior."""


def weighted_posterior(
    model: SpeedModel, flow: TrainedFlow, settings: WeighingSettings, seed: int
) -> PosteriorDraws:
    """Weight draws of the flow and the prior to the exact posterior of the model's recording."""
    remembering = RememberingModel(model)
    proposal = flow_proposal(flow, model.recording)
    weighted = weigh(remembering, proposal, settings.draws, settings.prior_fraction, seed)
    return _posterior(weighted, remembering.predict(weighted.phi))


def check_recordings(
    model: SpeedModel,
    recordings: Sequence[SpeedRecording],
    flow: TrainedFlow,
    conditioning: ConditioningSettings,
    settings: SyntheticSettings,
    seed: int,
    name: str,
) -> Checks:
    """Infer recordings of one subject and return what the tests look at in each; n rows.

    Args:
        model: The subject's model; its passive shape depends on the context alone.
        recordings: The n recordings, at least one.
        flow: The proposal.
        conditioning: How speeds become the features that the tests look at.
        settings: Weighted draws of each recording, and the width of the strip at a bound.
        seed: Study seed; each recording has a stream of its own.
        name: Names the streams and the progress lines.
    """
    progress = Progress(f"{model.recording.subject}, {name} recordings", len(recordings), unit="recording")
    rows = []
    for index, recording in enumerate(recordings):
        stream = ("misspecification", name, model.recording.subject, index)
        own = replace(model, recording=recording)
        posterior = weighted_posterior(own, flow, settings, integer_seed(seed, *stream))
        rng = generator(seed, *stream, "replicated")
        rows.append(check_recording(own, posterior, conditioning, settings.strip_fraction, rng))
        progress.step()
    return stack_checks(rows)


def _posterior(weighted: WeightedDraws, predicted: PredictedSpeeds) -> PosteriorDraws:
    return PosteriorDraws(weighted.phi, weighted.weight, predicted, weighted.k_hat, weighted.efficiency)
