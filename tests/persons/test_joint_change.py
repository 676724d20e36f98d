"""Two visits inferred together, in whole: with nothing shared it is each by itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import exact_case
import numpy as np
import pytest
import speed_case

from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.persons.change.joint import DEGREES_OF_FREEDOM, Change, infer_change, joined_proposal
from swesbi.persons.change.visits import visits_model
from swesbi.persons.settings import ChangeRuleSettings, ChangeSettings, SharesSettings
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.fitted import WIDENING, FittedProposal, StudentProposal
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.space import LogitSpace

NOTHING = dict.fromkeys(SharesSettings.model_fields, 0.0)
RULE = ChangeRuleSettings(threshold=0.1, probability=0.95, power=0.8, one_person_level=0.05, null_draws=500)
PHASES = 20
FACTOR = 1.15  # of all speeds of the later visit
TIMING = 0.015


@cache
def models(timing_cycle: float = TIMING) -> tuple[SpeedModel, SpeedModel]:
    plain = speed_case.model(PHASES)
    discrepancy = DiscrepancySettings(speed_fraction=0.02, timing_cycle=timing_cycle)
    first = replace(plain, settings=plain.settings.model_copy(update={"discrepancy": discrepancy}))
    faster = replace(first.recording, speed_m_s=FACTOR * first.recording.speed_m_s)
    return first, replace(first, recording=faster)


@cache
def own(timing_cycle: float = TIMING) -> tuple[ExactPosterior, ...]:
    found = []
    starts = (speed_case.PHI, speed_case.PHI * [FACTOR**2, 1.0, 1.0, FACTOR**2])
    for model, start in zip(models(timing_cycle), starts, strict=True):
        heart = HeartModel(model)
        exact, _ = exact_posterior(heart, exact_case.fitted(heart, start), exact_case.SETTINGS, 1)
        assert exact.sampler == "importance"
        found.append(exact)
    return tuple(found)


def space() -> LogitSpace:
    return LogitSpace(HeartModel(models()[0]).settings.prior)


@cache
def change(discrepancy: float) -> Change:
    shares = SharesSettings.from_plain(NOTHING | {"discrepancy": discrepancy})
    chosen = ChangeSettings(shares=shares, rule=RULE, exact=exact_case.SETTINGS)
    index = [np.arange(PHASES)] * 2
    both = visits_model(models(), index, chosen.shares.of(models()[0].settings.prior.names), discrepancy)
    return infer_change(both, own(), [space()] * 2, chosen, 3, "person")


def test_where_nothing_is_shared_both_posteriors_are_as_they_were() -> None:
    found = change(0.0)
    assert found.exact.sampler == "importance"
    assert found.exact.converged
    for visit, alone in zip(found.phi, own(), strict=True):
        together, apart = np.log(visit), np.log(alone.phi)
        sd = apart.std(axis=0)
        np.testing.assert_allclose((together.mean(axis=0) - apart.mean(axis=0)) / sd, 0.0, atol=0.15)
        np.testing.assert_allclose(together.std(axis=0) / sd, 1.0, atol=0.1)
    np.testing.assert_allclose(found.ratios.narrowing, 0.0, atol=0.1)
    assert found.one_person.log_bayes_factor == pytest.approx(0.0, abs=0.15)
    assert not found.one_person.flagged


def test_an_error_that_both_share_narrows_the_ratios_and_a_change_of_all_speeds_is_found() -> None:
    found, apart = change(1.0), change(0.0)
    assert found.ratios.low[-1] < FACTOR**2 < found.ratios.high[-1]
    assert found.ratios.risen[-1] > RULE.probability
    assert (found.ratios.sd_log < apart.ratios.sd_log).all()


def alone(model: SpeedModel, posterior: ExactPosterior) -> float:
    """Return the effective share of the draws of a proposal fitted to the posterior of one visit."""
    heart = HeartModel(model)
    u, _ = space().place(heart.points(posterior.phi))
    student = StudentProposal(u.mean(axis=0), WIDENING * np.cov(u.T), DEGREES_OF_FREEDOM)
    return exact_case.weigh(heart, FittedProposal(student, space()), 2000, 0.1, 1).efficiency


@pytest.mark.parametrize(
    ("tied", "discrepancy"), [({}, 0.0), ({}, 1.0), ({"passive_stiffness_kpa": 0.9, "k0_kpa": 0.8}, 0.9)]
)
def test_the_first_proposal_of_both_is_as_good_as_those_of_each(
    tied: dict[str, float], discrepancy: float
) -> None:
    """Whatever ties them, the passive stiffness too, which is integrated out."""
    pair, posteriors = models(0.0), own(0.0)
    shares = np.array([tied.get(name, 0.0) for name in pair[0].settings.prior.names])
    both = visits_model(pair, [np.arange(PHASES)] * 2, shares, discrepancy)
    first = joined_proposal(both, [each.phi for each in posteriors], [space()] * 2)
    found = exact_case.weigh(both, first, 2000, 0.1, 1).efficiency
    independent = np.prod([alone(*each) for each in zip(pair, posteriors, strict=True)])
    assert independent > 0.4
    assert found > 0.8 * independent


def test_three_visits_are_no_pair_to_compare() -> None:
    three = visits_model((*models(), models()[0]), [np.arange(PHASES)] * 3, np.zeros(4), 0.0)
    chosen = ChangeSettings(shares=SharesSettings.from_plain(NOTHING), rule=RULE, exact=exact_case.SETTINGS)
    with pytest.raises(ValueError, match="3 visits: a change is between two"):
        infer_change(three, own(), [space()] * 2, chosen, 1)


def test_shares_are_of_the_parameters_named_and_zero_of_all_others() -> None:
    names = speed_case.settings("calibrated").prior.names
    shares = SharesSettings.from_plain(NOTHING | {"passive_ratio": 0.5, "discrepancy": 0.7})
    found = dict(zip(names, shares.of(names), strict=True))
    assert found.pop("passive_ratio") == 0.5
    assert set(found.values()) == {0.0}
