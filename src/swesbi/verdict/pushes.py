"""The tests of a free-running recording, and their null distributions.

The tests of a gated recording look at features of a curve. Pushes have no curve, so two questions are left:
do their residuals fit, and does the posterior press on a bound of the prior? Both are compared with
well-specified recordings of fresh hearts with about as many pushes, whose errors are known or declared
likewise. So their levels are exact, though a posterior predictive p-value alone is conservative.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.special import chdtrc, logsumexp

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray, IntArray, below_each_other, rows_of
from swesbi.base.progress import Progress
from swesbi.draws import resampled_rows
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats
from swesbi.measurement.instants import FreeModel
from swesbi.measurement.speeds import PredictedSpeeds
from swesbi.networks.flow.flow import TrainedFlow, free_proposal
from swesbi.population.recordings import FreshSettings, record_pushes
from swesbi.population.settings import NullSettings
from swesbi.posterior.exact import weighted_posterior
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.seeds import generator, integer_seed
from swesbi.verdict.nulls import Grade, fit_joint_null
from swesbi.verdict.settings import RuleSettings
from swesbi.verdict.statistics import boundary_statistic, misfit_score, prior_strip_mass, strip_mass
from swesbi.verdict.verdict import VerdictTest
from swesbi.verdict.with_null import ByNull, Found, VerdictSettings, boundary_detail

STREAM: Final = "null pushes"
NEAREST: Final = 200  # null recordings that one is held against: a level of 5 % within 1.5 points
MEMBERS: Final = ((0,), (1,))
"""The tests of each group: residuals, then bounds."""


@dataclass(frozen=True)
class PushChecks:
    """What the tests look at in n free-running recordings."""

    pushes: Annotated[IntArray, Variable("recording", "1", "accepted pushes")]
    errors_log_sd: Annotated[
        FloatArray, Variable("recording", "1", "prior sd of the log of a factor of all errors, 0 where known")
    ]
    residuals_p: Annotated[
        FloatArray, Variable("recording", "1", "posterior predictive p-value of the squared residuals")
    ]
    bound_mass: Annotated[
        FloatArray,
        Variable("recording bounded bound", "1", "posterior mass in the strip there"),
    ]

    def statistics(self, prior_mass: FloatArray, strip_level: float) -> FloatArray:
        """Return the statistic of each test, large where the model misfits; shape (n, 2)."""
        bounds = boundary_statistic(self.bound_mass, prior_mass, strip_level)
        return np.stack([misfit_score(self.residuals_p), bounds], axis=1)


def check_pushes(
    model: FreeModel,
    phi: FloatArray,
    weight: FloatArray,
    predicted: PredictedSpeeds,
    strip_fraction: float,
    rng: np.random.Generator,
) -> PushChecks:
    """Return what the tests look at in one recording.

    Args:
        model: The recording and its model.
        phi: Draws of its posterior; shape (n, d).
        weight: Of each draw; shape (n,).
        predicted: Of equally weighted draws that can be simulated.
        strip_fraction: Width of the strip at a bound, over the box's.
        rng: Draws the factor of the errors.
    """
    return PushChecks(
        pushes=np.array([len(model.cell)]),
        errors_log_sd=np.array([model.noise_log_sd]),
        residuals_p=np.array([residuals_p_value(model, predicted, rng)]),
        bound_mass=strip_mass(phi, weight, model.settings.prior, strip_fraction)[None],
    )


def residuals_p_value(model: FreeModel, predicted: PredictedSpeeds, rng: np.random.Generator) -> float:
    """Return the posterior predictive p-value of the squared residuals, over factors of the errors as well.

    Given phi and the factor, the standardised residuals of a new recording are independent normals, so that
    the p-value of each draw is that of chi-squared with as many degrees of freedom as there are pushes.

    Args:
        model: The recording and its model.
        predicted: Of n equally weighted posterior draws that can be simulated.
        rng: Draws the factor of each.
    """
    factor = model.draw_factor(predicted, rng)
    return float(np.mean(chdtrc(len(model.cell), model.innovations(predicted, factor).chi_squared)))


def draw_pushes_null(
    index: Sequence[int],
    flow: TrainedFlow,
    fresh: FreshSettings,
    sizes: NullSettings,
    exact: ExactSettings,
    seed: int,
) -> PushChecks:
    """Make and infer the numbered free-running recordings of the null.

    Args:
        index: Numbers of the recordings.
        flow: The trained network.
        fresh: Where recordings come from.
        sizes: Effective draws and width of the strips.
        exact: The study's own settings of the exact posterior.
        seed: The study's seed.
    """
    progress = Progress("null recordings of pushes", len(index), unit="recording")
    asked, found = fresh.conditions.free_running.pushes, []
    for number in index:
        model, _ = record_pushes(number, asked, fresh, seed, STREAM)
        stream = integer_seed(seed, STREAM, number)
        proposal = free_proposal(flow, model)
        drawn, _ = weighted_posterior(model, proposal, sizes.effective_draws, exact, stream)
        rng = generator(stream, "residuals")
        rows = resampled_rows(drawn.weight, sizes.effective_draws, rng)
        predicted = model.predict(drawn.phi[rows])
        found.append(check_pushes(model, drawn.phi, drawn.weight, predicted, sizes.strip_fraction, rng))
        progress.step()
    return below_each_other(found)


def nearest(null: PushChecks, pushes: int, declared: bool) -> PushChecks:
    """Return the null recordings that are nearest in their number of pushes, of the same kind of errors.

    Args:
        null: Null recordings.
        pushes: How many the recording has.
        declared: Its errors are declared and integrated out; else they are known.
    """
    alike = np.flatnonzero((null.errors_log_sd > 0.0) == declared)
    distance = np.abs(np.log(null.pushes[alike] / pushes))
    return rows_of(null, alike[np.argsort(distance, kind="stable")[:NEAREST]])


def overall_p_values(
    null: PushChecks, checks: PushChecks, prior_mass: FloatArray, rule: RuleSettings
) -> FloatArray:
    """Return the overall p-value of each of n recordings against those of the null; shape (n,)."""
    overall = np.empty(len(checks.pushes))
    declared, level = checks.errors_log_sd > 0.0, rule.strained_level
    statistics = checks.statistics(prior_mass, level)
    for count, kind in set(zip(checks.pushes.tolist(), declared.tolist(), strict=True)):
        rows = (checks.pushes == count) & (declared == kind)
        alike = nearest(null, count, kind).statistics(prior_mass, level)
        joint = fit_joint_null(alike, MEMBERS, rule.tail_fraction)
        overall[rows] = joint.overall_p(joint.test_p(statistics[rows]))
    return overall


def against_pushes(
    exact: ExactPosterior,
    model: FreeModel,
    beats: Beats,
    null: PushChecks,
    settings: VerdictSettings,
    seed: int,
) -> Found:
    """Judge a free-running recording by residuals and strips; the seed is of the factors of the errors."""
    prior, fraction = model.settings.prior, settings.strip_fraction
    works = beats.status == Status.PERIODIC
    predicted = model.predict_from(exact.phi, beats).rows(np.flatnonzero(works))
    rng = generator(seed, "verdict", model.model.recording.context.subject)
    checks = check_pushes(model, exact.phi, works / works.sum(), predicted, fraction, rng)
    by_null = held_against(null, checks, prior_strip_mass(prior, fraction), settings.rule)
    return by_null, _farthest(model, predicted)


def held_against(null: PushChecks, checks: PushChecks, prior_mass: FloatArray, rule: RuleSettings) -> ByNull:
    """Return what the tests of one recording (a row) amount to against null recordings.

    Args:
        null: Null recordings.
        checks: What the tests look at in the recording.
        prior_mass: Mass of the prior in the strip at each bound; shape (6, 2).
        rule: Levels of the verdict.
    """
    count, declared = int(checks.pushes[0]), bool(checks.errors_log_sd[0] > 0.0)
    alike = nearest(null, count, declared)
    joint = fit_joint_null(alike.statistics(prior_mass, rule.strained_level), MEMBERS, rule.tail_fraction)
    statistics = checks.statistics(prior_mass, rule.strained_level)
    test_p = joint.test_p(statistics)
    against = f"null recordings of {alike.pushes.min()} to {alike.pushes.max()} pushes"
    residuals = (
        f"posterior predictive p-value {checks.residuals_p[0]:.2g} of {count} pushes, against {against}"
    )
    bounds = boundary_detail(checks.bound_mass[0], prior_mass, rule.strained_level)
    limits = joint.thresholds(rule.strained_level)
    named = (("residuals", residuals), ("boundary_mass", bounds))
    tests = tuple(
        VerdictTest(name, float(value), float(p), float(limit), bool(p <= limit), detail)
        for (name, detail), value, p, limit in zip(named, statistics[0], test_p[0], limits, strict=True)
    )
    overall_p = float(joint.overall_p(test_p)[0])
    status = Grade((overall_p <= rule.strained_level) + (overall_p <= rule.contradicted_level))
    return ByNull(status, overall_p, tests)


def _farthest(model: FreeModel, predicted: PredictedSpeeds) -> tuple[float, str]:
    """Return the largest standardised residual at the likeliest of n simulations, and where it is."""
    best = np.array([int(np.argmax(logsumexp(model.log_joint(predicted), axis=0)))])
    z = np.abs(model.innovations(predicted.rows(best)).z[0])
    return float(z.max()), f"push at {model.model.recording.phase[int(np.argmax(z))]:.3f} of its beat"
