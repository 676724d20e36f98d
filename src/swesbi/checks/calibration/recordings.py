"""Synthetic recordings of one subject, inferred by the network and exactly, and what checks need of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
from swesbi.measurement.likelihood import CachedModel, SpeedModel, residuals
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.networks.spline.flow import FlowProposal, TrainedSpline, flow_proposal
from swesbi.population.synthetic import Synthetic
from swesbi.posterior.exact import exact_posterior, weight_failures
from swesbi.posterior.importance import LikelihoodModel, Proposal, WeightedDraws, k_hat_limit, weigh
from swesbi.posterior.refine import refine
from swesbi.posterior.settings import ExactSettings, RefinementSettings
from swesbi.progress import Progress
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.statistics import strip_mass

FloatArray = NDArray[np.float64]
MOST_TIMES: Final = 10
"""More draws of a proposal than so many times the usual number take longer than refining it."""
FEWER_EFFECTIVE: Final = 0.5
FEWER_DRAWS: Final = 0.3
"""Effective draws that a refined proposal is fitted to, and draws of a round at most, over those of a
posterior that is reported: hard recordings then take a third of the time, and end as efficient."""
MARGIN: Final = 1.5
"""Draws of a second attempt over those that the efficiency of the first, itself a guess, asks for."""


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


@dataclass(frozen=True)
class ExactDraws:
    """Weighted draws of a posterior.

    Attributes:
        phi: Draws; shape (n, d).
        weight: Their weights, which sum to one; shape (n,).
        log_likelihood: Exact log-likelihood of each; shape (n,).
        k_hat: Pareto shape of the importance weights behind them.
        efficiency: Effective share of these weights.
        log_evidence: By these weights.
        by_mcmc: Whether MCMC took over from the weights.
    """

    phi: FloatArray
    weight: FloatArray
    log_likelihood: FloatArray
    k_hat: float
    efficiency: float
    log_evidence: float
    by_mcmc: bool


def exact_draws(
    model: LikelihoodModel,
    network: Proposal,
    draws: int,
    settings: ExactSettings,
    seed: int,
) -> ExactDraws:
    """Return the exact posterior as the study reports it, with fewer weighted draws where these suffice.

    Where so few draws fail the criteria of the weights, as many are weighted as their efficiency asks for, up
    to ``MOST_TIMES`` the number; where that is too few, the proposal is refined until it is usable, by fewer
    draws than for a posterior that is reported; where its weights fail too, it is refined as such a posterior
    is, twice if need be, the study's own number follows, and MCMC at last. No recording is left out.

    Args:
        model: Prior and exact likelihood.
        network: The network's posterior.
        draws: Weighted draws of the first attempt.
        settings: The study's own sizes and criteria.
        seed: Seed of everything.
    """
    usable = settings.refinement.usable_efficiency
    least_effective, by_mcmc = usable * draws, False

    def fails(weighted: WeightedDraws) -> bool:
        limit = k_hat_limit(len(weighted.phi), settings.max_k_hat)
        return bool(weight_failures(weighted, limit, least_effective))

    proposal = network
    weighted = weigh(model, proposal, draws, settings.prior_fraction, seed)
    more = max(draws, round(MARGIN * least_effective / weighted.efficiency))
    if fails(weighted) and more <= MOST_TIMES * draws:
        weighted = weigh(model, proposal, more, settings.prior_fraction, integer_seed(seed, "more"))
    for name, refinement in _refinements(settings.refinement).items():
        if fails(weighted):
            proposal = refine(model, network, refinement, integer_seed(seed, name)).proposal
            weighted = weigh(
                model, proposal, draws, settings.prior_fraction, integer_seed(seed, name, "draws")
            )
    if fails(weighted):
        posterior = exact_posterior(model, proposal, settings, seed)
        weighted, by_mcmc = posterior.weighted, posterior.sampler == "mcmc"
    drawn = ExactDraws(
        phi=weighted.phi,
        weight=weighted.weight,
        log_likelihood=weighted.log_likelihood,
        k_hat=weighted.k_hat,
        efficiency=weighted.efficiency,
        log_evidence=weighted.log_evidence,
        by_mcmc=by_mcmc,
    )
    if not by_mcmc:
        return drawn
    log_likelihood = model.log_likelihood(posterior.phi)
    weight = equal_weights(len(posterior.phi))
    return replace(drawn, phi=posterior.phi, weight=weight, log_likelihood=log_likelihood)


def _refinements(settings: RefinementSettings) -> dict[str, RefinementSettings]:
    """Return the ways in which a proposal is refined until it is usable, by names of their random streams.

    The last is the second with another seed: of a posterior with two modes a proposal may miss one by chance,
    and MCMC, which then takes minutes, crosses between them no better.
    """
    usable = settings.model_copy(update={"min_efficiency": settings.usable_efficiency})
    fewer = {
        "effective_draws": round(settings.effective_draws * FEWER_EFFECTIVE),
        "most_draws": max(settings.draws, round(settings.most_draws * FEWER_DRAWS)),
    }
    return {
        "refined": usable.model_copy(update=fewer),
        "refined again": usable,
        "refined once more": usable,
    }


def infer_recordings(
    model: SpeedModel,
    synthetic: Synthetic,
    flow: TrainedSpline,
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
    cached = CachedModel(model)
    drawn = exact_draws(cached, network, settings.weighted_draws, exact, case.seed)
    values = quantities(drawn.phi, drawn.log_likelihood, model.activation_duration_s(drawn.phi))
    return _Result(
        truth=truth,
        network=case.score(truth, np.stack(draws), equal_weights(len(draws))),
        weighted=case.score(truth, values, drawn.weight),
        diagnostics=_diagnose(case, drawn, cached.predict(drawn.phi), settings),
    )


def _diagnose(
    case: _Case, drawn: ExactDraws, predicted: PredictedSpeeds, settings: RecordingsSettings
) -> Diagnostics:
    rows = resampled_rows(drawn.weight, settings.misfit_draws, generator(case.seed, "misfit"))
    chi2 = misfit(case.model, predicted.rows(rows))
    prior = case.model.settings.prior
    return Diagnostics(
        k_hat=np.array(drawn.k_hat),
        efficiency=np.array(drawn.efficiency),
        log_evidence=np.array(drawn.log_evidence),
        by_mcmc=np.array(drawn.by_mcmc),
        phases=np.array(len(case.model.recording.phase)),
        min_chi2=np.array(chi2.min_chi2),
        mean_chi2=np.array(chi2.mean_chi2),
        strip_mass=strip_mass(drawn.phi, drawn.weight, prior, settings.strip_fraction),
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
