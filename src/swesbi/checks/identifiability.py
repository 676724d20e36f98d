"""What the recordings of a cohort tell of each quantity, without a search: from posterior draws alone.

Quantities are what is reported of phi, and the isometric stiffness.

What a posterior owes to its prior and to its likelihood is told by scaling the power of either. Draws are
weighted by density^(alpha - 1), for alpha = 1.25 and 1 / 1.25, and the weights Pareto-smoothed:
so the posterior of a prior, or a likelihood, to the power of alpha needs no further draw. How far it lies
from the posterior is told, of each quantity, by the cumulative Jensen-Shannon distance. With distribution
functions P and Q over the range of the draws, and M = (P + Q) / 2,

    distance^2 = int [P log2(P / M) + Q log2(Q / M)] dx / int (P + Q) dx,

of x or of -x, whichever is larger. The sensitivity is the distance per unit of log2 alpha (Kallioinen,
Paananen, Buerkner and Vehtari, Stat Comput 34:57, 2024, Sec. 2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
from scipy.special import rel_entr

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.calibration.ranks import standardised
from swesbi.checks.information import (
    Expectation,
    PhaseInformation,
    repeats_of,
    simulated_stencil,
)
from swesbi.checks.settings import IdentifiabilitySettings
from swesbi.heart.model import isometric_stiffness_kpa
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.parameters import ISOMETRIC, K_0, K_ATP, OF_INTEREST, PHI_NAMES
from swesbi.posterior.diagnostics import smooth
from swesbi.posterior.result import ExactPosterior
from swesbi.prior import BoxPrior, spread_points
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.seeds import generator


class Identified(NamedTuple):
    """Tables of what recordings tell, a row a subject and quantity.

    ``correlations`` have a row a parameter of these, ``information`` one a measured phase.
    """

    summary: PlainTable
    correlations: PlainTable
    information: PlainTable


def identifiability_of_cohort(
    posteriors: BySubject[ExactPosterior],
    observations: tuple[Observation, ...],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    identifiability: IdentifiabilitySettings,
    seed: int,
) -> Identified:
    """Study every subject of the cohort.

    Raises:
        ValueError: A reference beat does not become periodic, or there is no subject.
    """
    if not observations:
        raise ValueError("no subject: the cohort is empty")
    progress, found = Progress("identifiability", len(observations), "subject"), []
    for observed in observations:
        phi = posteriors[observed.subject].phi
        if not len(phi):
            fault = f"that of {observed.subject} holds no posterior draw; delete it and rerun"
            raise UnfitError("posteriors", fault)
        of_subject = identified(speed_model(observed, noise, model), phi, identifiability, seed)
        of_subject.information["position"] = np.flatnonzero(observed.measured)[
            of_subject.information["position"]
        ]
        for table in of_subject:
            table.insert(0, "subject", observed.subject)
        found.append(of_subject)
        progress.step(note=observed.subject)
    return Identified(*(pd.concat(tables, ignore_index=True) for tables in zip(*found, strict=True)))


def identified(
    model: SpeedModel, phi: FloatArray, settings: IdentifiabilitySettings, seed: int
) -> Identified:
    """Study one recording, whose phases alone are counted, by its posterior draws (n, d)."""
    informing = drawn(phi, settings.information_draws, seed, model.recording.subject)
    simulated = simulated_stencil(model, informing, settings.difference_step)
    expected = Expectation.of(model, simulated, log_gradient(model, informing))
    correlations = correlation_table(model, phi)
    summary = summary_table(model, phi, expected).merge(strongest(correlations), on="quantity")
    return Identified(summary, correlations, information_table(model, expected.by_phase()))


def drawn(phi: FloatArray, number: int, seed: int, subject: str) -> FloatArray:
    """Return ``number`` of the posterior draws phi (n, d), or all if there are fewer."""
    rows = generator(seed, "identifiability", "information", subject).permutation(len(phi))[:number]
    return phi[np.sort(rows)]


def summary_table(model: SpeedModel, phi: FloatArray, expected: Expectation) -> pd.DataFrame:
    """Return a row a quantity: spread, found and expected, contraction, sensitivities, and more repeats.

    ``expected_sd_log`` is what another such recording would leave; ``width_4`` by what four times the
    repeats would multiply it. ``k_hat`` is the largest Pareto shape of the scaled weights.
    """
    prior, values = model.settings.prior, quantities(model, phi)
    before = prior_quantities(model)
    parts = parts_of_posterior(phi, prior, model.log_likelihood(phi))
    scaled = {name: sensitivity(np.log(values), part) for name, part in parts.items()}
    found, expected_log = np.log(values).std(axis=0), expected.sd(model.recording)
    more = repeats_of(expected)
    return pd.DataFrame(
        {
            "quantity": QUANTITY_NAMES,
            "median": np.median(values, axis=0),
            "sd_log": found,
            "contraction": contraction(values, before),
            "contraction_log": contraction(np.log(values), np.log(before)),
            **{f"sensitivity_{name}": part.distance for name, part in scaled.items()},
            "k_hat": max(part.k_hat for part in scaled.values()),
            "expected_sd_log": expected_log,
            "expected_over_found": expected_log / found,
            **{f"width_{times:g}": width for times, width in zip(more.times, more.width, strict=True)},
            "activation_duration_s": np.median(model.activation_duration_s(phi)),
        }
    )


def correlation_table(model: SpeedModel, phi: FloatArray) -> pd.DataFrame:
    """Return a row a quantity and parameter: the correlation of their logarithms in the posterior."""
    found = pd.DataFrame(log_correlations(quantities(model, phi), phi), columns=[*model.settings.prior.names])
    table = found.assign(quantity=QUANTITY_NAMES).melt(
        "quantity", var_name="parameter", value_name="correlation"
    )
    return table[table["quantity"] != table["parameter"]].reset_index(drop=True)


def strongest(correlations: pd.DataFrame) -> pd.DataFrame:
    """Return a row a quantity: the parameter with which it is correlated most, and how."""
    rows = correlations["correlation"].abs().groupby(correlations["quantity"]).idxmax()
    return correlations.loc[rows].rename(columns={"parameter": "correlated_with"})


def information_table(model: SpeedModel, phases: PhaseInformation) -> pd.DataFrame:
    """Return a row a quantity and phase: its share of the information, growth of the sd without it."""
    points = np.arange(len(model.recording.phase))
    return pd.DataFrame(
        {
            "quantity": np.repeat(QUANTITY_NAMES, len(points)),
            "position": np.tile(points, len(QUANTITY_NAMES)),
            "phase": np.tile(model.recording.phase, len(QUANTITY_NAMES)),
            "share": phases.share.ravel(),
            "expected_sd_increase": phases.sd_increase.ravel(),
        }
    )


QUANTITY_NAMES: Final = (*PHI_NAMES, ISOMETRIC)


def quantities(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return the reported part of phi (n, d) and k_0 (1 - exp(-k_ATP D_T)); shape (n, 5)."""
    return np.column_stack(
        [phi[:, OF_INTEREST], isometric_stiffness_kpa(phi, model.activation_duration_s(phi))]
    )


def prior_quantities(model: SpeedModel) -> FloatArray:
    """Return the quantities of 2^16 points spread over the prior by a Sobol sequence, (65536, 5)."""
    return quantities(model, spread_points(model.settings.prior))


def log_gradient(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return d log quantity / d log phi of phi (n, d), shape (n, 5, d).

    With u = k_ATP D_T, log(1 - exp(-u)) changes by u / (exp(u) - 1) for each unit of log k_ATP, and of log D.
    """
    names = model.settings.prior.names
    gradient = np.zeros((len(phi), len(QUANTITY_NAMES), len(names)))
    gradient[:, : len(PHI_NAMES), : len(PHI_NAMES)] = np.eye(len(PHI_NAMES))
    exponent = phi[:, K_ATP] * model.activation_duration_s(phi)
    gradient[:, -1, K_0] = 1.0
    gradient[:, -1, K_ATP] = exponent / np.expm1(exponent)
    if "activation_duration_s" in names:
        gradient[:, -1, names.index("activation_duration_s")] = gradient[:, -1, K_ATP]
    return gradient


def contraction(draws: FloatArray, prior_draws: FloatArray) -> FloatArray:
    """Return 1 - posterior variance / prior variance of quantities, by draws (n, q) and (m, q); (q,).

    One: the recording tells the quantity exactly. Zero: it tells nothing. Negative: the posterior is wider
    than the prior, which happens for a value far out in a skewed prior.
    """
    return np.asarray(1.0 - draws.var(axis=0) / prior_draws.var(axis=0))


def log_correlations(draws: FloatArray, parameters: FloatArray) -> FloatArray:
    """Return correlations (q, d) of the logarithms of quantities (n, q) and parameters (n, d)."""
    quantities = draws.shape[1]
    together = np.corrcoef(np.log(draws), np.log(parameters), rowvar=False)
    return np.asarray(together[:quantities, quantities:])


ALPHA: Final = 1.25
SENSITIVE: Final = 0.05
"""From here on a posterior is taken to depend on what is scaled (Kallioinen et al. 2024, Sec. 2.3)."""


@dataclass(frozen=True)
class Sensitivity:
    """How q quantities depend on one part of the posterior.

    ``distance`` (q,) is the cumulative Jensen-Shannon distance per unit of log2 alpha; ``k_hat`` the larger
    Pareto shape of the weights of both powers, reliable below 0.7.
    """

    distance: FloatArray
    k_hat: float


def sensitivity(values: FloatArray, log_density: FloatArray) -> Sensitivity:
    """Scale a part of a posterior, its log density (n,), in power, by equal draws (n, q) of quantities."""
    scaled = [smooth((alpha - 1.0) * log_density) for alpha in (ALPHA, 1.0 / ALPHA)]
    moved = [[cumulative_distance(each, np.exp(log_weight)) for each in values.T] for log_weight, _ in scaled]
    return Sensitivity(np.mean(moved, axis=0) / np.log2(ALPHA), max(k_hat for _, k_hat in scaled))


def cumulative_distance(values: FloatArray, weight: FloatArray) -> float:
    """Return the cumulative Jensen-Shannon distance that weights (n,), whose sum is one, move draws (n,)."""
    return max(_distance(values, weight), _distance(-values, weight))


def _distance(values: FloatArray, weight: FloatArray) -> float:
    order = np.argsort(values, kind="stable")
    width = np.diff(values[order])
    before, after = np.arange(1, len(values)) / len(values), np.cumsum(weight[order])[:-1]
    middle = 0.5 * (before + after)
    apart = width @ (rel_entr(before, middle) + rel_entr(after, middle)) / np.log(2.0)
    whole = width @ (before + after)
    return float(np.sqrt(max(apart, 0.0) / whole)) if whole > 0.0 else 0.0  # rounding may leave it below 0


def parts_of_posterior(
    phi: FloatArray, prior: BoxPrior, log_likelihood: FloatArray
) -> Mapping[str, FloatArray]:
    """Return the logarithms of what a posterior is made of, up to constants, by name; (n,) each.

    The prior is scaled as a density of log phi, which is normal within its bounds: a power narrows it about
    its centre, and leaves the bounds. Nuisance parameters are many, and shift the posterior against the
    parameters of interest, so that both together would look like nothing.
    """
    of_each = -0.5 * standardised(phi, prior) ** 2
    return {
        "prior": of_each[:, OF_INTEREST].sum(axis=1),
        "nuisances": of_each[:, OF_INTEREST.stop :].sum(axis=1),
        "likelihood": log_likelihood,
    }
