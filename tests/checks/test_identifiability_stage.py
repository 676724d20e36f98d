"""The study of identifiability of a small cohort: its tables, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import speed_case
from comparison_case import observation
from evaluation_study import noise_of

from swesbi.artefacts import ArtefactError
from swesbi.checks.identifiability import QUANTITY_NAMES, Identified, identifiability_of_cohort, identified
from swesbi.checks.information import TIMES
from swesbi.checks.settings import IdentifiabilitySettings
from swesbi.recording.observation import Observation

SETTINGS = IdentifiabilitySettings(difference_step=0.02, information_draws=6, repeats_draws=6)
SD = np.array([0.1, 0.2, 0.07, 0.03])
MISSING = 7
"""The phase that the recordings lack."""


def phi(seed: int = 1, count: int = 300) -> np.ndarray:
    return np.asarray(speed_case.PHI * np.exp(np.random.default_rng(seed).normal(0.0, SD, (count, 4))))


def recorded(subject: str) -> Observation:
    speed_m_s = speed_case.model().recording.speed_m_s
    return replace(observation(subject), phase=(np.arange(20) + 0.5) / 20.0, speed_m_s=speed_m_s)


def cohort(posteriors: dict[str, np.ndarray]) -> Identified:
    return identifiability_of_cohort(
        {name: SimpleNamespace(phi=each) for name, each in posteriors.items()},  # type: ignore[arg-type]
        tuple(map(recorded, posteriors)),
        noise_of(posteriors),
        model=speed_case.settings(),
        identifiability=SETTINGS,
        seed=1,
    )


@cache
def found() -> Identified:
    return cohort({"A": phi(), "B": phi(2)})


def test_a_cohort_without_subjects_or_draws_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        cohort({})
    with pytest.raises(ArtefactError, match="that of A holds no posterior draw"):
        cohort({"A": phi()[:0]})


def test_a_missing_phase_has_no_row() -> None:
    table = found().information
    assert len(table) == 2 * 19 * len(QUANTITY_NAMES)
    of_one = table[(table["subject"] == "A") & (table["quantity"] == "k0_kpa")]
    assert of_one["position"].tolist() == [place for place in range(20) if place != MISSING]
    np.testing.assert_allclose(of_one["phase"], (of_one["position"] + 0.5) / 20.0)
    np.testing.assert_allclose(table.groupby(["subject", "quantity"])["share"].sum(), 1.0)


def test_the_summary_is_of_the_posterior_that_is_given() -> None:
    table = found().summary.set_index(["subject", "quantity"])
    assert len(table) == 2 * len(QUANTITY_NAMES)
    np.testing.assert_allclose(table.loc["A", "sd_log"].iloc[:4], SD, rtol=0.1)
    prior_sd = np.array([part.log_sd for part in speed_case.settings().prior.parameters])
    narrowed = 1.0 - (SD / prior_sd) ** 2
    np.testing.assert_allclose(table.loc["A", "contraction_log"].iloc[:4], narrowed, atol=0.05)
    np.testing.assert_allclose(table["expected_over_found"], table["expected_sd_log"] / table["sd_log"])
    widths = table[[f"width_{times:g}" for times in TIMES]].to_numpy()
    assert (np.diff(widths, axis=1) < 0.0).all() and (widths < 1.0).all()
    assert (table[["sensitivity_prior", "sensitivity_likelihood"]] > 0.0).all(axis=None)
    assert (table["sensitivity_nuisances"] < 1e-6).all()  # this prior frees none


def test_correlations_name_the_parameter_that_moves_most() -> None:
    model = speed_case.model(prior="calibrated")
    centre, rng = speed_case.central_phi(model), np.random.default_rng(3)
    scores = rng.standard_normal((400, len(centre)))
    scale = model.settings.prior.names.index("speed_scale")
    scores[:, 3] = -0.9 * scores[:, scale] + np.sqrt(1.0 - 0.9**2) * scores[:, 3]
    tables = identified(model, centre * np.exp(0.02 * scores), SETTINGS, 1)
    row = tables.summary.set_index("quantity").loc["passive_stiffness_kpa"]
    assert (row["correlated_with"], row["correlation"]) == ("speed_scale", pytest.approx(-0.9, abs=0.03))
    pairs = tables.correlations
    assert len(pairs) == len(QUANTITY_NAMES) * len(centre) - 4
    assert not (pairs["quantity"] == pairs["parameter"]).any()


def test_a_likelihood_with_smaller_errors_counts_for_more() -> None:
    model = speed_case.model()
    exact = replace(model, recording=replace(model.recording, relative_se=np.full(20, 0.005)))
    near = speed_case.PHI * (phi() / speed_case.PHI) ** 0.2
    loose, tight = (
        identified(each, near, SETTINGS, 1).summary["sensitivity_likelihood"] for each in (model, exact)
    )
    assert (tight > loose).all()
