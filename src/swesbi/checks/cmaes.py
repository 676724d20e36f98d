"""The CMA-ES reference fit of one subject: loss, search, history of every run, artefact.

Hansen (2006), as implemented in the library ``cma``. The search runs in u = log(theta / low) /
log(high / low), so the box of the prior's bounds becomes the unit cube and one initial step serves
the three parameters.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from swesbi.artefacts import Artefact, Labels, Variable
from swesbi.base.arrays import FloatArray, IntArray
from swesbi.base.progress import Progress
from swesbi.checks.scores import rmse
from swesbi.checks.settings import CmaesSettings, CurveLossSettings
from swesbi.heart.periodic import Status
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import MeasuredSubject
from swesbi.measurement.operator import PassiveBaseline
from swesbi.measurement.settings import MeasurementSettings
from swesbi.parameters import THETA, THETA_COLUMNS, THETA_NAMES
from swesbi.prior import PriorSettings, bounds
from swesbi.recording.observation import Observation
from swesbi.seeds import generator

LOGGER = logging.getLogger("swesbi")


@dataclass(frozen=True)
class CmaesRun:
    """The history of one seed over G permitted generations; NaN after an early stop.

    ``best_loss`` (G,) is the lowest loss up to each generation, ``best_theta`` (G, 3) its theta;
    ``evaluations`` (G,) are the simulations up to there, constant after an early stop.
    """

    seed: int
    best_loss: FloatArray
    best_theta: FloatArray
    evaluations: IntArray
    generations: int
    stop: str

    @property
    def loss(self) -> float:
        """Lowest loss of the run."""
        return float(self.best_loss[self.generations - 1])

    @property
    def theta(self) -> FloatArray:
        """Theta of the lowest loss; shape (3,)."""
        return np.asarray(self.best_theta[self.generations - 1])


def best_run(runs: list[CmaesRun]) -> CmaesRun:
    """Return the run with the lowest loss; the first of equals."""
    return min(runs, key=lambda run: run.loss)


FAILED_LOSS = 1e3
"""Loss of a simulation that failed: finite, and worse than any curve's (a perfect curve has 0)."""


def curve_loss(curves: FloatArray, observed: FloatArray, weights: CurveLossSettings) -> FloatArray:
    """Return the loss of each curve: MAE / range + (1 - r) + |peak - observed peak| / observed peak.

    The paper (Sec. 2.5) names the three terms: normalised MAE, correlation mismatch, peak mismatch. A
    constant curve has no correlation; its r counts as 0. Curves (n, points) with a value that is not finite
    failed, and have ``FAILED_LOSS``.
    """
    failed = ~np.all(np.isfinite(curves), axis=1)
    usable = np.where(failed[:, None], observed, curves)
    mae = np.mean(np.abs(usable - observed), axis=1) / np.ptp(observed)
    peak = np.abs(usable.max(axis=1) - observed.max()) / observed.max()
    loss = (
        weights.mae_weight * mae
        + weights.correlation_weight * (1.0 - _correlation(usable, observed))
        + weights.peak_weight * peak
    )
    return np.where(failed, FAILED_LOSS, loss)


def _correlation(curves: FloatArray, observed: FloatArray) -> FloatArray:
    """Pearson's r of each curve with the observed one; 0 for a constant curve."""
    deviation = curves - curves.mean(axis=1, keepdims=True)
    target = observed - observed.mean()
    norm = np.linalg.norm(deviation, axis=1) * np.linalg.norm(target)
    return np.asarray(np.divide(deviation @ target, norm, out=np.zeros(len(curves)), where=norm > 0.0))


@dataclass(frozen=True)
class CmaesFit(Artefact, kind="cmaes"):
    """R runs of at most G generations, NaN after an early stop, and the best of them."""

    seed: Annotated[IntArray, Variable("run", "1", "seed of each run")]
    best_loss: Annotated[FloatArray, Variable("run generation", "1", "lowest loss up to each generation")]
    best_theta: Annotated[FloatArray, Variable("run generation parameter", THETA_COLUMNS, "its parameters")]
    evaluations: Annotated[IntArray, Variable("run generation", "1", "simulations up to each generation")]
    generations: Annotated[IntArray, Variable("run", "1", "generations run")]
    run_loss: Annotated[FloatArray, Variable("run", "1", "lowest loss of each run")]
    run_theta: Annotated[FloatArray, Variable("run parameter", THETA_COLUMNS, "parameters of that loss")]
    stop: Annotated[tuple[str, ...], Labels("run", "stop")]
    theta: Annotated[FloatArray, Variable("parameter", THETA_COLUMNS, "parameters of the best run")]
    loss: Annotated[float, Variable("", "1", "loss of the best run")]
    best_seed: Annotated[int, Variable("", "1", "seed of the best run")]
    grid: Annotated[
        FloatArray, Variable("grid", "1", "analysis phases, fraction of the cycle from the R peak")
    ]
    curve_kpa: Annotated[
        FloatArray, Variable("grid", "kPa", "total stiffness of the best theta, as measured")
    ]
    rmse_kpa: Annotated[float, Variable("", "kPa", "RMSE of that curve against the observed one")]

    labels = {"parameter": list(THETA_NAMES)}


def gather(
    runs: list[CmaesRun], curve_kpa: FloatArray, grid: FloatArray, observed_kpa: FloatArray
) -> CmaesFit:
    """Gather the runs; ``curve_kpa`` is the curve of the best run's theta, all curves of shape (grid,)."""
    best = best_run(runs)
    return CmaesFit(
        seed=np.array([run.seed for run in runs]),
        best_loss=np.stack([run.best_loss for run in runs]),
        best_theta=np.stack([run.best_theta for run in runs]),
        evaluations=np.stack([run.evaluations for run in runs]),
        generations=np.array([run.generations for run in runs]),
        run_loss=np.array([run.loss for run in runs]),
        run_theta=np.stack([run.theta for run in runs]),
        stop=tuple(run.stop for run in runs),
        theta=best.theta,
        loss=best.loss,
        best_seed=best.seed,
        grid=grid,
        curve_kpa=curve_kpa,
        rmse_kpa=rmse(observed_kpa, curve_kpa),
    )


Loss = Callable[[FloatArray], FloatArray]
"""Maps theta of shape (n, 3) to losses of shape (n,): a whole population in one call."""


def run_searches(
    loss: Loss, low: FloatArray, high: FloatArray, settings: CmaesSettings, label: str = "cmaes"
) -> list[CmaesRun]:
    """Run CMA-ES once a seed of the settings, in their order, between bounds (3,) of theta."""
    progress = Progress(label, total=len(settings.seeds), unit="run")
    runs = []
    for seed in settings.seeds:
        runs.append(_run(loss, low, high, settings, seed))
        progress.step(note=f"seed {seed}: loss {runs[-1].loss:.5f}, {runs[-1].stop}")
    return runs


def _run(loss: Loss, low: FloatArray, high: FloatArray, settings: CmaesSettings, seed: int) -> CmaesRun:
    import cma  # it loads pyplot, and most who import this module only read fits

    rng = generator(seed, "cmaes")
    evolution = cma.CMAEvolutionStrategy(
        rng.random(len(THETA)),
        settings.sigma0,
        _library_options(settings, rng),
    )
    losses, thetas = [], []
    best_loss, best_theta = np.inf, np.full(len(THETA), np.nan)
    while not evolution.stop():
        population = evolution.ask()
        theta = to_theta(np.array(population), low, high)
        values = loss(theta)
        evolution.tell(population, values.tolist())
        index = int(np.argmin(values))
        if values[index] < best_loss:
            best_loss, best_theta = float(values[index]), theta[index]
        losses.append(best_loss)
        thetas.append(best_theta)
    missing = settings.generations - len(losses)
    evaluations = settings.population_size * np.arange(1, len(losses) + 1)
    return CmaesRun(
        seed=seed,
        best_loss=np.pad(np.array(losses), (0, missing), constant_values=np.nan),
        best_theta=np.pad(np.array(thetas), ((0, missing), (0, 0)), constant_values=np.nan),
        evaluations=np.pad(evaluations, (0, missing), mode="edge"),
        generations=len(losses),
        stop=", ".join(sorted(map(str, evolution.stop()))),
    )


def _library_options(settings: CmaesSettings, rng: np.random.Generator) -> dict[str, Any]:
    """Return options of the library: unit cube, sizes, a random stream of our own, silence, no files."""
    return {
        "bounds": [0.0, 1.0],
        "popsize": settings.population_size,
        "maxiter": settings.generations,
        "randn": lambda *shape: rng.standard_normal(shape),
        "seed": np.nan,  # leaves NumPy's global random state alone
        "verbose": -9,
        "verb_log": 0,
        "verb_disp": 0,
    }


def to_theta(u: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Map u in [0, 1]^3, shape (n, 3), to theta within its bounds: theta = low (high / low)^u."""
    return np.clip(low * (high / low) ** u, low, high)


def simulated_curves(
    theta: FloatArray, subject: MeasuredSubject, forward_model: ForwardModelSettings
) -> FloatArray:
    """Return the curves (n, grid) of theta (n, 3) in kPa; NaN where the simulation failed."""
    beats = simulate(theta, subject.observation.context, forward_model)
    good = beats.status == Status.PERIODIC
    curves = np.full((len(theta), subject.measurement.grid_points), np.nan)
    if good.any():
        curves[good] = subject.on_grid(beats.cycle_phase, beats.active_stiffness_kpa[good])
    return curves


class CmaesFailure(RuntimeError):
    """No simulation of the search succeeded."""


def reference_fit(
    observation: Observation,
    passive: PassiveBaseline,
    *,
    search: CmaesSettings,
    cmaes_prior: PriorSettings,
    forward_model: ForwardModelSettings,
    measurement: MeasurementSettings,
) -> CmaesFit:
    """Fit theta to the observed curve, once a seed; of the prior only the bounds count.

    Raises:
        CmaesFailure: Every simulation failed.
    """
    subject = MeasuredSubject(observation, passive, measurement)

    def curves(theta: FloatArray) -> FloatArray:
        return simulated_curves(theta, subject, forward_model)

    def loss(theta: FloatArray) -> FloatArray:
        return curve_loss(curves(theta), observation.curve_kpa, search.loss)

    runs = run_searches(loss, *bounds(cmaes_prior), search, label=f"CMA-ES of {observation.subject}")
    best = best_run(runs)
    if best.loss >= FAILED_LOSS:
        raise CmaesFailure(
            f"subject {observation.subject}: every simulation within the prior's bounds failed; "
            "check the subject's context and the forward model's settings"
        )
    fit = gather(runs, curves(best.theta[None])[0], observation.grid, observation.curve_kpa)
    LOGGER.info(
        "subject %s: best loss %.4f (seed %d), RMSE %.2f kPa, theta %s, %d simulations",
        observation.subject,
        fit.loss,
        fit.best_seed,
        fit.rmse_kpa,
        np.round(fit.theta, 2).tolist(),
        int(fit.evaluations[:, -1].sum()),
    )
    return fit
