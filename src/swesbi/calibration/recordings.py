"""Infer many synthetic recordings of one subject by the network and exactly, and keep what checks need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swesbi.calibration.misfit import misfit
from swesbi.calibration.posteriors import Drawn, exact_draws
from swesbi.calibration.quantities import prior_variance, quantities
from swesbi.calibration.ranked import Diagnostics, Inferred, Ranked
from swesbi.calibration.scores import Score, score, stack_scores
from swesbi.calibration.settings import RecordingsSettings
from swesbi.calibration.tarp import reference_points
from swesbi.exact.proposal import FlowProposal
from swesbi.exact.settings import ExactSettings, RefinementSettings
from swesbi.exact.weights import equal_weights, resampled_rows
from swesbi.flow.net import TrainedFlow, draw_phi
from swesbi.misspecification.bounds import strip_mass
from swesbi.progress import Progress
from swesbi.seeds import generator, integer_seed
from swesbi.speed_model.model import SpeedModel
from swesbi.speed_model.prediction import PredictedSpeeds
from swesbi.speed_model.remembering import RememberingModel
from swesbi.speed_model.synthetic import Synthetic

FloatArray = NDArray[np.float64]


def infer_recordings(
    model: SpeedModel,
    synthetic: Synthetic,
    flow: TrainedFlow,
    settings: RecordingsSettings,
    exact: ExactSettings,
    seed: int,
    name: str,
    refinement: RefinementSettings | None = None,
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
        refinement: Where the answers of the study refine a proposal that fails, how.
    """
    subject, count = model.recording.subject, len(synthetic.phi)
    condition = np.stack([flow.conditioner.condition(recording) for recording in synthetic.recordings])
    network_seed = integer_seed(seed, "calibration", "network", name, subject)
    network_phi = draw_phi(flow, condition, settings.network_draws, network_seed)
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
        proposal = FlowProposal(flow, condition[index])
        results.append(_infer(case, network_phi[index], proposal, settings, exact, refinement))
        if progress:
            progress.step()
    return _gather(subject, results, prior_variance(model))


@dataclass(frozen=True)
class _Case:
    model: SpeedModel
    phi: FloatArray
    reference: FloatArray
    seed: int

    def score(self, truth: FloatArray, values: FloatArray, weight: FloatArray) -> Score:
        return score(truth, values, weight, self.reference, self.model.settings.prior)


@dataclass(frozen=True)
class _Result:
    truth: FloatArray
    network: Score
    weighted: Score
    diagnostics: Diagnostics  # of one recording: no leading dimension


def _infer(
    case: _Case,
    network_phi: FloatArray,
    proposal: FlowProposal,
    settings: RecordingsSettings,
    exact: ExactSettings,
    refinement: RefinementSettings | None,
) -> _Result:
    model, duration_s = case.model, case.model.activation_duration_s
    phi = np.concatenate([case.phi[None], network_phi])
    truth, *draws = quantities(phi, model.log_likelihood(phi), duration_s)
    remembering = RememberingModel(model)
    drawn = exact_draws(remembering, proposal, settings.weighted_draws, exact, case.seed, refinement)
    values = quantities(drawn.phi, drawn.log_likelihood, duration_s)
    return _Result(
        truth=truth,
        network=case.score(truth, np.stack(draws), equal_weights(len(draws))),
        weighted=case.score(truth, values, drawn.weight),
        diagnostics=_diagnose(case, drawn, remembering.predict(drawn.phi), settings),
    )


def _diagnose(
    case: _Case, drawn: Drawn, predicted: PredictedSpeeds, settings: RecordingsSettings
) -> Diagnostics:
    rows = resampled_rows(drawn.weight, settings.misfit_draws, generator(case.seed, "misfit"))
    found = misfit(case.model, predicted.rows(rows))
    prior = case.model.settings.prior
    return Diagnostics(
        k_hat=np.array(drawn.k_hat),
        efficiency=np.array(drawn.efficiency),
        log_evidence=np.array(drawn.log_evidence),
        by_mcmc=np.array(drawn.by_mcmc),
        phases=np.array(len(case.model.recording.phase)),
        min_chi2=np.array(found.min_chi2),
        mean_chi2=np.array(found.mean_chi2),
        strip_mass=strip_mass(drawn.phi, drawn.weight, prior, settings.strip_fraction),
    )


def _gather(subject: str, results: Sequence[_Result], variance: FloatArray) -> Inferred:
    parts = [one.diagnostics for one in results]
    arrays: dict[str, Any] = {
        field.name: np.stack([getattr(part, field.name) for part in parts]) for field in fields(Diagnostics)
    }
    ranked = Ranked(
        subject=np.full(len(results), subject),
        truth=np.stack([one.truth for one in results]),
        prior_variance=np.tile(variance, (len(results), 1)),
        network=stack_scores([one.network for one in results]),
        weighted=stack_scores([one.weighted for one in results]),
    )
    return Inferred(ranked, Diagnostics(**arrays))
