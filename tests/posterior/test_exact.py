"""The exact posterior of a recording: weights where they serve, the sampler where they do not."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import arviz
import numpy as np
import pytest
import speed_case
from exact_case import (
    PRIOR,
    SETTINGS,
    LogitNormal,
    LogNormal,
    ToyModel,
    ToySettings,
    check_posterior,
    fitted,
    proposal,
    weigh,
)
from pydantic import ValidationError

from swesbi.artefacts import Provenance
from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.ranks import standardised
from swesbi.parameters import PHI_NAMES, REPORTED_NAMES
from swesbi.posterior.adaptive import PriorProposal
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.posterior.truncated import Posterior
from swesbi.prior import to_logit
from swesbi.verdict.recording import answer_of
from swesbi.verdict.summary import answer_summary
from swesbi.verdict.verdict import Verdict

Z, COMPONENTS = np.array([0.5, -1.0, 2.0]), ("one", "two", "three")
PROVENANCE = Provenance("", "T", 1, {"a": 1}, "0" * 16)


@cache
def posterior(width: float = 1.0, shift: float = 0.0, settings: ExactSettings = SETTINGS) -> ExactPosterior:
    return exact_posterior(ToyModel(), proposal(width, shift), settings, 1)[0]


def written(path: Path, exact: ExactPosterior) -> Path:
    by_network = replace(exact, condition=Z, components=COMPONENTS, parameters=PRIOR.names)
    by_network.write(path, PROVENANCE)
    return path


@pytest.mark.parametrize(("width", "shift"), [(1.0, 0.0), (1.3, 0.8)])
def test_good_weights_are_used(width: float, shift: float) -> None:
    exact = posterior(width, shift)
    assert exact.sampler == "importance"
    assert exact.converged
    assert exact.reasons == ()
    assert np.isnan(exact.r_hat).all()
    assert exact.phi.shape == (SETTINGS.draws, 4)
    check_posterior(exact.phi, 1.0 / (1.0 / SETTINGS.draws + 1.0 / exact.effective_draws[0]))


NEVER = SETTINGS.model_copy(update={"max_rounds": 0})
"""A network that is wrong then has nothing to make up for it but MCMC."""


@pytest.mark.parametrize(("width", "shift"), [(0.2, 2.0), (0.15, 0.0), (1.0, 6.0)])
def test_the_sampler_takes_over_from_a_bad_proposal_and_is_right(width: float, shift: float) -> None:
    exact = posterior(width, shift, NEVER)
    assert exact.sampler == "mcmc"
    assert exact.converged
    assert exact.reasons
    assert exact.r_hat.max() < 1.01
    check_posterior(exact.phi, 0.5 * exact.effective_draws.min())
    with pytest.raises(AssertionError):
        check_posterior(exact.proposal_phi, 1000)


@pytest.mark.parametrize(("width", "shift"), [(0.2, 2.0), (0.15, 0.0), (1.0, 6.0), (0.2, 15.0)])
def test_rounds_make_up_for_a_bad_proposal(width: float, shift: float) -> None:
    exact, drawn = exact_posterior(ToyModel(), proposal(width, shift), SETTINGS, 2)
    assert exact.sampler == "importance"
    assert drawn.efficiency[0] < 0.5 * drawn.efficiency[-1]
    assert exact.efficiency == drawn.efficiency[-1]
    assert exact.effective_draws.min() >= SETTINGS.effective_draws
    check_posterior(exact.phi, 1.0 / (1.0 / SETTINGS.draws + 1.0 / exact.effective_draws[0]))


def test_each_criterion_calls_the_sampler_alone() -> None:
    strict = NEVER.model_copy(update={"max_k_hat": 0.01, "min_effective_draws": 100})
    by_k_hat = posterior(0.8, settings=strict)
    assert by_k_hat.sampler == "mcmc"
    assert [reason.split()[1] for reason in by_k_hat.reasons] == ["Pareto"]
    assert by_k_hat.k_hat_limit == 0.01
    by_number = posterior(settings=NEVER.model_copy(update={"min_effective_draws": 950}))
    assert by_number.sampler == "mcmc"
    (reason,) = by_number.reasons
    assert re.fullmatch(r"9\d\d of 1000 weighted draws are effective, fewer than 950", reason)


def test_rounds_end_where_they_are_asked_to_and_fewer_draws_are_still_accepted() -> None:
    few = posterior(settings=asking(SETTINGS, 300))
    assert len(few.weighted.phi) == SETTINGS.first_draws
    short = SETTINGS.model_copy(update={"effective_draws": 10**6, "max_rounds": 1})
    exact = posterior(settings=short)
    assert exact.sampler == "importance"
    assert len(exact.weighted.phi) == SETTINGS.first_draws + SETTINGS.round_draws


def test_a_sampler_that_does_not_converge_is_recorded(tmp_path: Path) -> None:
    mcmc = SETTINGS.mcmc.model_copy(update={"max_steps": 500, "max_r_hat": 1.00001})
    exact = posterior(0.2, 2.0, NEVER.model_copy(update={"mcmc": mcmc}))
    assert not exact.converged
    assert "MCMC has not converged" in exact.reasons[-1]
    assert "after 500 steps" in exact.reasons[-1]
    read = ExactPosterior.read(written(tmp_path / "posterior.h5", exact))
    assert not read.converged
    assert read.reasons == exact.reasons


@pytest.mark.parametrize("settings", [SETTINGS, NEVER])
def test_the_artefact_reads_back(tmp_path: Path, settings: ExactSettings) -> None:
    exact = posterior(0.2, 2.0, settings)
    read = ExactPosterior.read(written(tmp_path / "posterior.h5", exact))
    assert (read.components, read.interval_mass) == (COMPONENTS, SETTINGS.interval)
    for name in ("phi", "proposal_phi", "r_hat", "effective_draws"):
        np.testing.assert_array_equal(getattr(read, name), getattr(exact, name))
    for name in ("sampler", "reasons", "k_hat", "k_hat_limit", "efficiency", "mcmc_steps", "log_evidence"):
        assert getattr(read, name) == getattr(exact, name)
    for name in ("phi", "from_prior", "log_weight", "log_likelihood"):
        np.testing.assert_array_equal(getattr(read.weighted, name), getattr(exact.weighted, name))


@dataclass(frozen=True)
class WideModel:
    """A posterior under any joint prior: that of a recording that knows each log parameter equally well."""

    settings: ToySettings

    def log_likelihood(self, phi: FloatArray) -> FloatArray:
        return -0.5 * (standardised(phi, self.settings.prior) ** 2).sum(axis=1)


FEW = SETTINGS.model_copy(
    update={
        "effective_draws": 100,
        "draws": 500,
        "min_effective_draws": 20,
        "mcmc": SETTINGS.mcmc.model_copy(update={"steps": 40, "max_steps": 40}),
    }
)
BY_MCMC = FEW.model_copy(update={"max_rounds": 0, "min_effective_draws": 1999})


def test_draws_of_the_prior_are_the_proposal_where_there_is_no_network(tmp_path: Path) -> None:
    exact = exact_posterior(ToyModel(), None, SETTINGS, 1)[0]
    path = tmp_path / "posterior.h5"
    replace(exact, parameters=PRIOR.names).write(path, PROVENANCE)
    np.testing.assert_array_equal(ExactPosterior.read(path).proposal_phi, exact.proposal_phi)


@pytest.mark.parametrize(("settings", "sampler"), [(FEW, "importance"), (BY_MCMC, "mcmc")])
@pytest.mark.parametrize(("name", "nuisances"), [("paper", 0), ("calibrated", 15)])
def test_nuisances_are_kept_beside_what_is_reported(
    tmp_path: Path, name: str, nuisances: int, settings: ExactSettings, sampler: str
) -> None:
    prior = speed_case.settings(name).prior
    exact = exact_posterior(WideModel(ToySettings(prior)), PriorProposal(prior), settings, 1)[0]
    path = tmp_path / "posterior.h5"
    by_network = replace(exact, condition=Z, components=COMPONENTS, parameters=prior.names)
    by_network.write(path, PROVENANCE)
    read = ExactPosterior.read(path)
    assert (read.sampler, read.phi.shape) == (sampler, (500, 4 + nuisances))
    for found, expected in (
        (read.phi, exact.phi),
        (read.proposal_phi, exact.proposal_phi),
        (read.weighted.phi, exact.weighted.phi),
        (read.r_hat, exact.r_hat),
    ):
        np.testing.assert_array_equal(found, expected)
    groups, _ = ExactPosterior.load(path)
    assert groups["/"]["joint_parameter"].to_numpy().tolist() == list(prior.names)
    for group in ("posterior", "proposal", "weighted"):
        kept = groups[group]
        assert kept["nuisance"].to_numpy().tolist() == list(prior.nuisance_names)
        assert kept["nuisance_parameters"].values.shape[-1] == nuisances
    of_posterior = groups["posterior"].at("chain", 0)
    for number, parameter in enumerate(prior.names):
        column = (
            of_posterior[parameter]
            if number < 4
            else of_posterior["nuisance_parameters"].values[:, number - 4]
        )
        np.testing.assert_array_equal(column, exact.phi[:, number])


def test_the_artefact_is_a_posterior_like_any_other(tmp_path: Path) -> None:
    exact = posterior()
    path = written(tmp_path / "posterior.h5", exact)
    common = Posterior.read(path)
    np.testing.assert_array_equal(common.theta, exact.phi[:, :3])
    np.testing.assert_allclose(common.median, np.median(exact.phi[:, :3], axis=0))
    np.testing.assert_allclose(common.interval[:, 1], np.quantile(exact.phi[:, :3], 0.95, axis=0))
    np.testing.assert_array_equal(common.unfiltered, exact.proposal_phi[:, :3])
    assert common.unfiltered_in_prior.all()
    assert common.interval_mass == SETTINGS.interval
    assert common.component_names == COMPONENTS
    np.testing.assert_array_equal(common.z_obs, Z)
    opened = arviz.from_netcdf(str(path), engine="h5netcdf")
    assert opened.posterior["passive_stiffness_kpa"].shape == (1, SETTINGS.draws)
    assert opened.posterior["passive_stiffness_kpa"].attrs["units"] == "kPa"


def test_what_is_integrated_out_is_drawn_beside_mcmc_and_has_no_ensembles() -> None:
    """Of a recording without nuisances that is the passive stiffness, here as told by all four parameters."""
    model, short = speed_case.model(), {"steps": 120, "max_steps": 120, "min_effective_draws": 1}
    mcmc = SETTINGS.mcmc.model_copy(update=short | {"max_r_hat": 1.1})
    settings = NEVER.model_copy(update={"min_effective_draws": 1001, "mcmc": mcmc})
    exact = exact_posterior(HeartModel(model), PriorProposal(model.settings.prior.simulated), settings, 1)[0]
    assert (exact.sampler, exact.phi.shape) == ("mcmc", (settings.draws, 4))
    assert exact.converged and (exact.r_hat[:3] < 1.1).all() and np.isnan(exact.r_hat[3])
    assert exact.effective_draws[3] == exact.effective_draws[:3].min()
    known, log_phi = weigh(model, fitted(model), 8000, 0.1, 1), np.log(exact.phi)
    mean = known.weight @ np.log(known.phi)
    sd = np.sqrt(known.weight @ (np.log(known.phi) - mean) ** 2)
    error = sd * np.sqrt(1.0 / exact.effective_draws + 1.0 / (known.efficiency * 8000))
    assert (error < 0.1 * sd).all()
    assert (np.abs(log_phi.mean(axis=0) - mean) < 4.5 * error).all()
    np.testing.assert_allclose(log_phi.std(axis=0), sd, rtol=0.15)


def test_an_answer_is_read_from_its_verdict_alone(tmp_path: Path) -> None:
    draws = np.random.default_rng(1).lognormal(size=(len(REPORTED_NAMES), 500))
    told = answer_of(dict(zip(REPORTED_NAMES, draws, strict=True)), 0.9)
    judged = Verdict(
        0.5, "peak", 9, 10, dict.fromkeys(PHI_NAMES[:3], 1.0), "doubtful", "why", (),
        k_hat=None, efficiency=0.4, sampler="mcmc", answer=told,
    )  # fmt: skip
    judged.write(tmp_path / "verdict.json", Provenance(""))
    answer = answer_summary(Verdict.read(tmp_path / "verdict.json"))
    np.testing.assert_allclose(answer.limits, np.quantile(draws, [0.5, 0.05, 0.95], axis=1).T)
    assert (answer.status, answer.sampler, answer.interval_mass) == ("doubtful", "mcmc", 0.9)


def test_settings_that_cannot_work_are_refused() -> None:
    with pytest.raises(ValidationError, match="a round of the sampler leaves only 38400"):
        ExactSettings.from_plain({**SETTINGS.to_plain(), "draws": 50_000})
    with pytest.raises(ValidationError, match="is less than min_effective_draws = 800"):
        ExactSettings.from_plain({**SETTINGS.to_plain(), "effective_draws": 700})


@pytest.mark.slow
def test_weights_and_sampler_agree_on_the_speed_model() -> None:
    good, prior = fitted(speed_case.model()), speed_case.settings().prior
    moved = good.mean + 2.0 * np.sqrt(np.diag(good.covariance))
    bad = LogitNormal(moved, 0.01 * good.covariance, good.prior)
    model = speed_case.model()
    weighted = [exact_posterior(model, network, SETTINGS, 1)[0] for network in (good, bad, None)]
    sampled, _ = exact_posterior(model, bad, NEVER, 1)
    assert [part.sampler for part in weighted] == ["importance"] * 3
    assert sampled.sampler == "mcmc"
    other = to_logit(sampled.phi, prior)
    for part in weighted:
        low, high = np.quantile(part.phi, [0.02, 0.98], axis=0)
        assert np.all((low < speed_case.PHI) & (high > speed_case.PHI))
        one = to_logit(part.phi, prior)
        numbers = [np.minimum(own.effective_draws, SETTINGS.draws) for own in (sampled, part)]
        sd, error = one.std(axis=0), 4.0 * np.sqrt(sum(1.0 / number for number in numbers))
        assert np.all(np.abs(one.mean(axis=0) - other.mean(axis=0)) / sd < error)
        # widths of the 90 % intervals, since the standard deviation of k_SR hangs on its long tail
        widths = [np.ptp(np.quantile(draws, (0.05, 0.95), axis=0), axis=0) for draws in (one, other)]
        assert np.all(np.abs(widths[1] / widths[0] - 1.0) < error)


def test_a_proposal_far_from_the_posterior_is_no_excuse() -> None:
    """Draws of the proposal all lie in another corner of the prior."""
    corner = LogNormal(np.log([90.0, 12.0, 15.0, 4.0]), 0.01 * np.eye(4))
    for settings, sampler in ((SETTINGS, "importance"), (NEVER, "mcmc")):
        exact, _ = exact_posterior(ToyModel(), corner, settings, 3)
        assert exact.sampler == sampler
        check_posterior(exact.phi, 0.5 * exact.effective_draws.min())
