"""What the recordings of a cohort tell of each quantity, without a search: from posterior draws alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from swesbi.artefacts import UnfitError
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.checks.identifiability.information import (
    Expectation,
    PhaseInformation,
    repeats_of,
    simulated_stencil,
)
from swesbi.checks.identifiability.power_scaling import parts_of_posterior, sensitivity
from swesbi.checks.identifiability.quantities import (
    QUANTITY_NAMES,
    contraction,
    log_correlations,
    log_gradient,
    prior_quantities,
    quantities,
)
from swesbi.checks.settings import IdentifiabilitySettings
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.posterior.result import ExactPosterior
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
    narrowed = contraction(values, prior_quantities(model))
    parts = parts_of_posterior(phi, prior, model.log_likelihood(phi))
    scaled = {name: sensitivity(np.log(values), part) for name, part in parts.items()}
    found, expected_log = np.log(values).std(axis=0), expected.sd(model.recording)
    more = repeats_of(expected)
    return pd.DataFrame(
        {
            "quantity": QUANTITY_NAMES,
            "median": np.median(values, axis=0),
            "sd_log": found,
            "contraction": narrowed.linear,
            "contraction_log": narrowed.logarithm,
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
