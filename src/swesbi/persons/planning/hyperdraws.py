"""Hyperparameters at which every study of a bank is evaluated, and each person's likelihood there.

A study is the population's posterior given some persons, who are independent given eta: its log likelihood is
the sum of theirs. So each person of a bank is evaluated once, at draws of eta that serve every study,

    eta_i ~ q = (1 - f) mean_s q_s + f p,

where q_s is fitted to the posterior of the whole bank with its likelihood to the power n_s / (2.5 N): about
as wide as the posteriors of studies of n_s persons and the scatter of their middles together. A study's
weights are p(eta_i) / q(eta_i) times its likelihood, normalised; a study then costs a sum over its persons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import logsumexp

from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.persons.change.groups import ratio_hyperprior
from swesbi.persons.change.settings import ChangeGroupsSettings
from swesbi.persons.cohort.cohort import Design
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of
from swesbi.persons.cohort.model import CohortModel, PriorAlone, equal_draws
from swesbi.persons.cohort.ratio import RatioPrior
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.persons.planning.bank import ARMS, EFFECT, NONE, Bank
from swesbi.persons.planning.settings import GROUPS, PAIRED, PlannedStudiesSettings
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.importance import Proposal
from swesbi.posterior.settings import asking
from swesbi.posterior.space import PlacedProposal
from swesbi.prior import PriorSettings, draw_prior, log_density
from swesbi.seeds import generator, integer_seed

STREAM: Final = "plan"
WIDER: Final = 2.5
"""Variance of what a proposal is fitted to, over that of a study's posterior."""
PRIOR_FRACTION: Final = 0.05
EFFECTIVE_DRAWS: Final = 400  # to which a proposal is fitted: twenty for each hyperparameter
TREATED: Final = "treated"


@dataclass(frozen=True)
class StudyAnalysis:
    """By what settings a study is analysed: hyperpriors and effort of the posterior of a cohort.

    Attributes:
        theta: The prior of theta.
        cohort: Of the posterior of a cohort.
        changes: Of the change in groups.
    """

    theta: PriorSettings
    cohort: HierarchySettings
    changes: ChangeGroupsSettings


@dataclass(frozen=True)
class Likelihoods:
    """Persons of a bank at common hyperparameters eta, m of them.

    Attributes:
        eta: Shape (m, k).
        prior: p(eta).
        log_drawn: log q(eta), of what they were drawn from; shape (m,).
        effect_columns: Columns of eta that the effect is told by, one a parameter.
        changing: Of each person as one who has the effect or, in the arm without, as one of whom it is asked;
            by arm, (m, N) each. Ratios without an effect come twice, (m, 2 N): as they are, and with both
            visits the other way round.
        control: Of each person as one of the control group; shape (m, N); of width 0 where there is none.
    """

    eta: FloatArray
    prior: Hyperprior
    log_drawn: FloatArray
    effect_columns: range
    changing: dict[str, FloatArray]
    control: FloatArray

    def displaced(self, number: int, by: float) -> tuple[FloatArray, FloatArray]:
        """Return what studies are told by where all likelihoods lie elsewhere.

        Likelihoods that lie higher by c in a log parameter are, at a median or factor higher by c, what they
        were: the hyperdraws move with them, and their prior alone is evaluated anew. (Bounds at which the
        population is truncated would move too; its persons hardly reach them.)

        Args:
            number: Of the parameter.
            by: c, of the persons who have the effect.

        Returns:
            Logarithm of what the effect is told by, and log p - log q; shape (m,) each.
        """
        column = self.effect_columns[number]
        moved = self.eta.copy()
        moved[:, column] *= np.exp(by)
        # densities are per unit of eta, which stretches as it moves: by one factor, that weights do not show
        return np.log(moved[:, column]), log_density(moved, self.prior) - self.log_drawn


def evaluate_bank(
    bank: Bank, design: str, settings: PlannedStudiesSettings, by: StudyAnalysis, seed: int
) -> Likelihoods:
    """Draw the common hyperparameters, and evaluate every person of a bank there.

    Args:
        bank: The persons.
        design: ``paired``: ratios of two visits of one group; ``groups``: theta of two groups.
        settings: How many hyperparameters.
        by: Hyperpriors.
        seed: The study's seed.
    """
    prior = _hyperprior(design, by)
    proposals = _proposals(bank, design, prior, settings, by, seed)
    eta, log_drawn = _draw(proposals, prior, settings, seed)
    progress = Progress("likelihood of the bank's persons", 3 if design == GROUPS else 2, unit="part")

    def evaluated(arm: str, treated: bool) -> FloatArray:
        draws = _balanced(bank.of_arm(arm)) if (design, arm) == (PAIRED, NONE) else bank.of_arm(arm)
        values = _model(draws, [treated] * len(draws), design, prior, by).by_subject(eta)
        progress.step()
        return values

    return Likelihoods(
        eta=eta,
        prior=prior,
        log_drawn=log_drawn,
        effect_columns=range(3) if design == PAIRED else range(6, 9),
        changing={arm: evaluated(arm, treated=True) for arm in ARMS},
        control=evaluated(NONE, treated=False) if design == GROUPS else np.empty((len(eta), 0)),
    )


def _balanced(ratios: FloatArray) -> FloatArray:
    """Return ratios (N, n, 3) of visits that nothing lies between, and those of later visits put first."""
    return np.concatenate([ratios, 1.0 / ratios])


def planned_design(design: str, treated: Sequence[bool]) -> Design:
    """Return the design of persons in one group, or in two; persons are alike in all covariates."""
    groups = () if design == PAIRED else ("control", TREATED)
    column = np.array(treated, dtype=float)[:, None]
    return Design((), np.empty(0), groups, column[:, : max(len(groups) - 1, 0)], ())


def _hyperprior(design: str, by: StudyAnalysis) -> Hyperprior:
    planned = planned_design(design, [False])
    if design == PAIRED:
        return ratio_hyperprior(planned, by.changes.hyperprior)
    return hyperprior_of(planned, by.theta, by.cohort.hyperprior)


def _model(
    values: FloatArray, treated: Sequence[bool], design: str, prior: Hyperprior, by: StudyAnalysis
) -> CohortModel:
    """Return the model of persons with draws (N, n, 3), none of whose recordings is contradicted."""
    return CohortModel(
        settings=PriorAlone(prior),
        recycled=equal_draws(list(values)),
        design=planned_design(design, treated).matrix,
        outlier=np.full(len(values), by.cohort.outliers.not_contradicted),
        theta_prior=RatioPrior(by.theta) if design == PAIRED else by.theta,
    )


@dataclass(frozen=True)
class _Tempered:
    """A model whose likelihood is taken to a power."""

    model: CohortModel
    power: float

    @property
    def settings(self) -> PriorAlone:
        return self.model.settings

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        return self.power * self.model.log_likelihood(phi)


def _proposals(
    bank: Bank, design: str, prior: Hyperprior, settings: PlannedStudiesSettings, by: StudyAnalysis, seed: int
) -> list[Proposal]:
    """Return a proposal for each size of study, with the effect and without."""
    found: list[Proposal] = []
    rough, rounds = by.cohort.rough_draws, asking(by.cohort.exact, EFFECTIVE_DRAWS)
    progress = Progress("hyperparameters of studies", len(settings.proposal_sizes) * len(ARMS), unit="size")
    for arm in (EFFECT, NONE):
        model = _whole(bank, arm, design, prior, by).thinned(rough)
        first: PlacedProposal | None = None
        for size in sorted(settings.proposal_sizes):
            power = size * (2 if design == GROUPS else 1) / (WIDER * len(model.recycled))
            stream = integer_seed(seed, STREAM, arm, size)
            first = adapted(_Tempered(model, power), rounds, stream, first).proposal()
            found.append(first)
            progress.step()
    return found


def _whole(bank: Bank, arm: str, design: str, prior: Hyperprior, by: StudyAnalysis) -> CohortModel:
    """Return the model of the whole bank: of one group, or of everyone in both groups."""
    if design == PAIRED:
        draws = _balanced(bank.of_arm(arm)) if arm == NONE else bank.of_arm(arm)
        return _model(draws, [True] * len(draws), design, prior, by)
    values = np.concatenate([bank.of_arm(NONE), bank.of_arm(arm)])
    number = len(bank.number)
    return _model(values, [False] * number + [True] * number, design, prior, by)


def _draw(
    proposals: Sequence[Proposal], prior: Hyperprior, settings: PlannedStudiesSettings, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return eta (m, k) of the mixture q of all proposals and the hyperprior, with log q (m,)."""
    drawn = [
        proposal.draw(settings.hyperdraws, integer_seed(seed, STREAM, "hyperdraws", number))
        for number, proposal in enumerate(proposals)
    ]
    of_prior = round(PRIOR_FRACTION / (1.0 - PRIOR_FRACTION) * settings.hyperdraws * len(proposals))
    drawn.append(draw_prior(prior, of_prior, generator(seed, STREAM, "hyperprior")))
    eta = np.concatenate(drawn)
    share = np.array([len(rows) for rows in drawn]) / len(eta)
    parts = np.stack([*(proposal.log_density(eta) for proposal in proposals), log_density(eta, prior)])
    return eta, np.asarray(logsumexp(parts, axis=0, b=share[:, None]))
