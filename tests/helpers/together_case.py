"""Hyperparameters and the parameters of six persons by recycling, and by MCMC over all of them together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import hierarchy_case as case
import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from swesbi.checks.calibration.two_samples import classifier_accuracy
from swesbi.persons.cohort.cohort import Member, design_of
from swesbi.persons.cohort.hyperprior import hyperprior_of, in_rows
from swesbi.persons.cohort.model import population_law
from swesbi.persons.cohort.ratio import log_normal_mass
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.posterior.mcmc import sample_mcmc
from swesbi.posterior.settings import McmcSettings
from swesbi.prior import ParameterPrior, PriorSettings, bounds

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TogetherPrior:
    """Priors of the hyperparameters, then of theta of every subject."""

    parameters: tuple[ParameterPrior, ...]


@dataclass(frozen=True)
class TogetherSettings:
    prior: TogetherPrior


@dataclass(frozen=True)
class Together:
    """Hyperparameters and theta of all subjects in one model, without recycling.

    The prior of theta is pi; what the population says of it instead is part of the likelihood.
    """

    settings: TogetherSettings
    hyperparameters: int
    design: FloatArray
    outlier: FloatArray
    measured: case.Measured

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        """Return log p(data, theta | eta) - log pi(theta) of (eta, theta) in rows (n, k + 3 d)."""
        eta = phi[:, : self.hyperparameters]
        log_theta = np.log(phi[:, self.hyperparameters :].reshape(len(phi), -1, 3))
        mean, spread = population_law(np.log(in_rows(eta)), self.design)
        own = log_truncated(log_theta, mean, np.broadcast_to(spread[:, None], mean.shape))
        parameters = case.THETA_PRIOR.parameters
        centre = np.log([parameter.centre for parameter in parameters])
        prior_sd = np.array([parameter.log_sd for parameter in parameters])
        ratio = own - log_truncated(log_theta, centre, prior_sd)
        with np.errstate(divide="ignore"):
            mixed = np.logaddexp(np.log1p(-self.outlier) + ratio, np.log(self.outlier))
        data = norm.logpdf(self.measured.log_theta, log_theta, self.measured.error_sd).sum(axis=(1, 2))
        return np.asarray(mixed.sum(axis=1) + data)


def log_truncated(log_theta: FloatArray, mean: FloatArray, sd: FloatArray) -> FloatArray:
    """Return the log density of log theta (n, d, 3), truncated normals; (n, d)."""
    low, high = (np.log(limit) for limit in bounds(case.THETA_PRIOR))
    mass = log_normal_mass((low - mean) / sd, (high - mean) / sd)
    return np.asarray((norm.logpdf(log_theta, mean, sd) - mass).sum(axis=-1))


TOGETHER_MCMC = McmcSettings(
    ensembles=4,
    walkers=96,
    steps=2000,
    max_steps=40_000,
    warm_up_fraction=0.25,
    max_r_hat=1.01,
    min_effective_draws=1000,
)


def joint_accuracy(settings: HierarchySettings, seed: int, draws: int = 2200) -> tuple[float, int]:
    """Return how often a classifier tells recycling from MCMC over everything, and the distinct draws.

    Six persons of one sex, age and heart rate: medians, spreads, and theta of each; 24 dimensions.
    """
    rng = np.random.default_rng(seed)
    cohort = [replace(case.contexts(1, rng, "F")[0], subject=f"s{number}") for number in range(6)]
    cohort = [replace(context, age_years=40.0, hr_bpm=65.0) for context in cohort]
    none = np.empty((0, 3))
    design = design_of([Member(context, "not contradicted", "", none, none) for context in cohort])
    prior = hyperprior_of(design, case.THETA_PRIOR.parameters, settings.hyperprior)
    eta = np.array([40.0, 6.0, 25.0, 0.3, 0.3, 0.3])
    outlier = np.full(6, settings.outliers.not_contradicted)
    theta, measured = case.draw_members(eta, design, outlier, rng)
    exact = settings.exact.model_copy(update={"effective_draws": 4 * draws, "max_rounds": 40, "draws": draws})
    fine = settings.model_copy(update={"exact": exact, "shown_draws": draws, "draws": 4000})
    members = case.members_of(measured, cohort, ["not contradicted"] * 6, [""] * 6, 20_000, fine.draws)

    def redraw(subject: str, narrower: PriorSettings, stream: int) -> FloatArray:
        return measured.posterior(int(subject[1:]), narrower, fine.draws, stream)

    inferred = case.infer(members, fine, redraw, seed)
    of_subjects = [
        each.theta[inferred.shrinkage.rows[:, d]] for d, each in enumerate(inferred.model.recycled)
    ]
    recycled = np.hstack([inferred.eta, *of_subjects])
    together = TogetherPrior((*prior.parameters, *(case.THETA_PRIOR.parameters * 6)))
    model = Together(TogetherSettings(together), len(eta), design.matrix, outlier, measured)
    points = TOGETHER_MCMC.start_points
    start = np.hstack([inferred.eta[:points], *(each[:points] for each in of_subjects)])
    sampled = sample_mcmc(model, start, TOGETHER_MCMC, seed, least_effective=2 * draws)
    assert sampled.converged
    chains = sampled.thinned(draws, np.random.default_rng(seed))  # some two autocorrelation times apart
    accuracy = classifier_accuracy(recycled, chains, together, seed)
    return accuracy, len(np.unique(inferred.eta, axis=0))
