"""Recordings inferred under one structure: at the shipped discrepancy, at one chosen anew, and changed."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from studies.discrepancy.evidence import Bank, PriorProposal, cover_pairs, evidence_se
from studies.ladder.posteriors import (
    CHANGED,
    CHOSEN,
    SHIPPED,
    LadderPosterior,
    PairEvidence,
    StructureResult,
)
from studies.ladder.quantities import changed_recording, quantities_of
from studies.ladder.settings import LadderEffort
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.draws import effective_draws, normalised
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.posterior.space import PlacedProposal
from swesbi.posterior.student import fitted_proposal
from swesbi.prior import to_logit
from swesbi.seeds import generator, integer_seed

LOGGER = logging.getLogger("swesbi")
STREAM = "ladder"
"""Streams have names of subjects and answers, not of structures: those differ by their equations alone."""
ProposalOf = Callable[[SpeedRecording], PlacedProposal]
"""Gives the first proposal for a recording, over the phi of one prior."""


@dataclass(frozen=True)
class Rung:
    """One structure, and what it takes to infer a recording under it.

    Attributes:
        first: First proposals under the structure's prior.
        exact: Sizes and criteria of the posteriors.
        effort: Grid of the discrepancy, effort, change within a person.
        seed: The study's seed.
    """

    first: ProposalOf
    exact: ExactSettings
    effort: LadderEffort
    seed: int

    def infer(self, model: SpeedModel, answer: str) -> tuple[LadderPosterior, FloatArray]:
        """Return the posterior of one recording, and its draws phi (n, d)."""
        subject, proposal = model.recording.subject, self.first(model.recording)
        exact, _ = exact_posterior(
            HeartModel(model), proposal, self.exact, self.seed, STREAM, answer, subject
        )
        return _summary(model, exact, answer), exact.phi

    def score_pairs(
        self, model: SpeedModel, phi: FloatArray, pairs: Sequence[DiscrepancySettings]
    ) -> PairEvidence:
        """Return the evidence of each pair, from one bank of simulations about posterior draws phi (n, d)."""
        rng = generator(self.seed, STREAM, "bank", model.recording.subject)
        bank, per_round = Bank(model, pairs), self.effort.simulations_per_round
        bank.extend(PriorProposal(bank.prior), per_round, rng)
        bank.extend(fitted_proposal(to_logit(phi, bank.prior), np.zeros(len(phi))), per_round, rng)
        cover_pairs(bank, per_round, self.effort.max_rounds, self.effort.min_effective_draws, rng)
        log_weights = bank.log_weights()
        effective = np.array([effective_draws(normalised(row)) for row in log_weights])
        draws = log_weights.shape[1]
        return PairEvidence(
            subject=model.recording.subject,
            log_evidence=np.logaddexp.reduce(log_weights, axis=1) - np.log(draws),
            log_evidence_se=np.array([evidence_se(each, draws) for each in effective]),
            effective_draws=effective,
        )


def _summary(model: SpeedModel, exact: ExactPosterior, answer: str) -> LadderPosterior:
    discrepancy = model.settings.discrepancy
    return LadderPosterior(
        subject=model.recording.subject,
        answer=answer,
        values=quantities_of(model, exact.phi),
        speed_fraction=discrepancy.speed_fraction,
        timing_cycle=discrepancy.timing_cycle,
        log_evidence=exact.log_evidence,
        log_evidence_se=exact.weighted.log_evidence_se,
        by_mcmc=exact.sampler == "mcmc",
        k_hat=exact.k_hat,
        efficiency=exact.efficiency,
        converged=exact.converged,
    )


def infer_structure(
    models: Sequence[SpeedModel], changed: Sequence[SpeedModel], rung: Rung, label: str
) -> StructureResult:
    """Infer every recording under one structure.

    Args:
        models: The recordings under the structure, at the shipped discrepancy.
        changed: The second recordings of the same persons, likewise.
        rung: How they are inferred.
        label: What the progress line says.

    Returns:
        The posteriors at the shipped pair, at the one of largest total evidence, and of the second
        recordings at the shipped one; the evidence of each pair by subject; and the pairs.
    """
    pairs = rung.effort.pairs(models[0].settings.discrepancy)
    progress = Progress(label, 2 * len(models), unit="recording")
    found, scores, draws = [], [], []
    for model, second in zip(models, changed, strict=True):
        posterior, phi = rung.infer(model, SHIPPED)
        found += [posterior, rung.infer(second, CHANGED)[0]]
        scores.append(rung.score_pairs(model, phi, pairs))
        draws.append(phi)
        progress.step(note=_account(posterior))
    best = pairs[best_pair(scores)]
    for model, of_shipped in zip(models, [one for one in found if one.answer == SHIPPED], strict=True):
        found.append(_chosen(rung, model, of_shipped, best))
        progress.step(note=_account(found[-1]))
    return StructureResult(tuple(found), tuple(scores), pairs)


def best_pair(scores: Sequence[PairEvidence]) -> int:
    """Return the number of the pair with the largest total log evidence over the subjects."""
    return int(np.sum([score.log_evidence for score in scores], axis=0).argmax())


def _chosen(
    rung: Rung, model: SpeedModel, of_shipped: LadderPosterior, pair: DiscrepancySettings
) -> LadderPosterior:
    """Return the posterior at the evidence's own pair; that at the shipped one where the two are one."""
    if pair == model.settings.discrepancy:
        return replace(of_shipped, answer=CHOSEN)
    settings = model.settings.model_copy(update={"discrepancy": pair})
    return rung.infer(replace(model, settings=settings), CHOSEN)[0]


def _account(posterior: LadderPosterior) -> str:
    reliable = "" if posterior.converged else ", not reliable"
    return (
        f"{posterior.subject}, {posterior.answer}: {posterior.sampler}, efficiency "
        f"{posterior.efficiency:.0%}, log evidence {posterior.log_evidence:.2f}{reliable}"
    )


def second_recording(
    base: SpeedModel, network: PlacedProposal, seed: int, effort: LadderEffort, draws: int
) -> SpeedRecording:
    """Return a second recording of the person, changed as `effort` says about what the network knows of it.

    Args:
        base: The first recording under the base's equations.
        network: The network's posterior of it, whose median is the person.
        seed: The study's seed.
        effort: Says the change.
        draws: Draws behind the median.
    """
    stream = integer_seed(seed, STREAM, "person", base.recording.subject)
    person = np.median(HeartModel(base).evaluated(network.draw(draws, stream)).phi, axis=0)
    return changed_recording(base, person, effort.change)
