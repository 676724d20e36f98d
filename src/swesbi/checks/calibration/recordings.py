"""Synthetic recordings of one subject, inferred by the network and exactly, and what checks need of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swesbi.base.progress import Progress
from swesbi.checks.calibration.ranks import (
    Diagnostics,
    Inferred,
    Ranked,
    RankScore,
    prior_variance,
    quantities,
    quantity_names,
    reference_points,
    score,
    stack_scores,
)
from swesbi.checks.calibration.settings import RecordingsSettings
from swesbi.draws import equal_weights, resampled_rows
from swesbi.measurement.likelihood import SpeedModel, residuals
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.networks.flow.flow import FlowProposal, TrainedFlow, flow_proposal
from swesbi.population.synthetic import Synthetic
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.importance import WeightedDraws
from swesbi.posterior.settings import ExactSettings
from swesbi.seeds import generator, integer_seed

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Misfit:
    """Sum of squared standardised residuals over posterior draws: the smallest, and the mean."""

    min_chi2: float
    mean_chi2: float


def misfit(model: SpeedModel, predicted: PredictedSpeeds) -> Misfit:
    """Return the misfit of what equally weighted posterior draws predict; failed simulations drop out."""
    z = residuals(predicted, model.recording, model.settings.discrepancy)
    chi2 = (z**2).sum(axis=1)
    return Misfit(float(np.nanmin(chi2)), float(np.nanmean(chi2)))


def infer_recordings(
    model: SpeedModel,
    synthetic: Synthetic,
    flow: TrainedFlow,
    settings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
    name: str,
) -> Inferred:
    """Infer every recording by both samplers.

    Args:
        model: The subject's model; each recording takes the place of its own.
        synthetic: The recordings and their phi, n of them, at least one.
        flow: The trained network.
        settings: Sizes.
        exact: The study's own settings of the exact posterior.
        seed: Seed of the study.
        name: Name of this set of recordings, for its random streams.
    """
    subject, count = model.recording.subject, len(synthetic.phi)
    rng = generator(seed, "calibration", "tarp", name, subject)
    references = reference_points(count, model.settings.prior, rng)
    progress = Progress(f"calibration {subject} ({name})", count, unit="recording") if count > 1 else None
    results: list[_Result] = []
    for index, recording in enumerate(synthetic.recordings):
        case = _Case(
            model=replace(model, recording=recording),
            phi=synthetic.phi[index],
            reference=references[index],
            seed=integer_seed(seed, "calibration", "exact", name, subject, index),
        )
        results.append(_infer(case, flow_proposal(flow, recording), settings, exact))
        if progress:
            progress.step()
    return _gather(model, results)


@dataclass(frozen=True)
class _Case:
    model: SpeedModel
    phi: FloatArray
    reference: FloatArray
    seed: int

    def score(self, truth: FloatArray, values: FloatArray, weight: FloatArray) -> RankScore:
        return score(truth, values, weight, self.reference, self.model.settings.prior)


@dataclass(frozen=True)
class _Result:
    truth: FloatArray
    network: RankScore
    weighted: RankScore
    diagnostics: Diagnostics  # of one recording: no leading dimension


def _infer(
    case: _Case,
    network: FlowProposal,
    settings: RecordingsSettings,
    exact: ExactSettings,
) -> _Result:
    model = case.model
    by_network = network.draw(settings.network_draws, integer_seed(case.seed, "network"))
    phi = np.concatenate([case.phi[None], by_network])
    truth, *draws = quantities(phi, model.log_likelihood(phi), model.activation_duration_s(phi))
    drawn, by_mcmc = weighted_posterior(model, network, settings.effective_draws, exact, case.seed)
    values = quantities(drawn.phi, drawn.log_likelihood, model.activation_duration_s(drawn.phi))
    return _Result(
        truth=truth,
        network=case.score(truth, np.stack(draws), equal_weights(len(draws))),
        weighted=case.score(truth, values, drawn.weight),
        diagnostics=_diagnose(case, drawn, by_mcmc, settings),
    )


def _diagnose(case: _Case, drawn: WeightedDraws, by_mcmc: bool, settings: RecordingsSettings) -> Diagnostics:
    rows = resampled_rows(drawn.weight, settings.misfit_draws, generator(case.seed, "misfit"))
    chi2 = misfit(case.model, case.model.predict(drawn.phi[rows]))
    return Diagnostics(
        k_hat=np.array(drawn.k_hat),
        efficiency=np.array(drawn.efficiency),
        log_evidence=np.array(drawn.log_evidence),
        by_mcmc=np.array(by_mcmc),
        phases=np.array(len(case.model.recording.phase)),
        min_chi2=np.array(chi2.min_chi2),
        mean_chi2=np.array(chi2.mean_chi2),
    )


def _gather(model: SpeedModel, results: Sequence[_Result]) -> Inferred:
    parts = [result.diagnostics for result in results]
    arrays: dict[str, Any] = {
        field.name: np.stack([getattr(part, field.name) for part in parts]) for field in fields(Diagnostics)
    }
    ranked = Ranked(
        names=quantity_names(model.settings.prior),
        subject=np.full(len(results), model.recording.subject),
        truth=np.stack([result.truth for result in results]),
        prior_variance=np.tile(prior_variance(model), (len(results), 1)),
        network=stack_scores([result.network for result in results]),
        weighted=stack_scores([result.weighted for result in results]),
    )
    return Inferred(ranked, Diagnostics(**arrays))
