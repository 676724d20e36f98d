"""Two visits inferred together, in whole: with nothing shared it is each by itself."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import exact_case
import numpy as np
import pytest
import speed_case

from swesbi.measurement.likelihood import SpeedModel
from swesbi.persons.change.joint import Change, OwnPosterior, infer_change
from swesbi.persons.change.settings import ChangeRuleSettings, ChangeSettings, SharesSettings
from swesbi.persons.change.visits import visits_model
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.space import LogitSpace

NOTHING = dict.fromkeys(SharesSettings.model_fields, 0.0)
RULE = ChangeRuleSettings(threshold=0.1, probability=0.95, power=0.8, one_person_level=0.05, null_draws=500)
PHASES = 20
FACTOR = 1.15  # of all speeds of the later visit


def settings(**shares: float) -> ChangeSettings:
    return ChangeSettings(
        shares=SharesSettings.from_plain(NOTHING | shares), rule=RULE, exact=exact_case.SETTINGS
    )


@cache
def models() -> tuple[SpeedModel, SpeedModel]:
    first = speed_case.model(PHASES)
    faster = replace(first.recording, speed_m_s=FACTOR * first.recording.speed_m_s)
    return first, replace(first, recording=faster)


@cache
def own() -> tuple[OwnPosterior, ...]:
    found = []
    starts = (speed_case.PHI, speed_case.PHI * [FACTOR**2, 1.0, 1.0, FACTOR**2])
    for model, start in zip(models(), starts, strict=True):
        exact, _ = exact_posterior(model, exact_case.fitted(model, start), exact_case.SETTINGS, 1)
        assert exact.sampler == "importance"
        effective = exact.efficiency * len(exact.weighted.phi)
        space = LogitSpace(model.settings.prior)
        found.append(OwnPosterior(exact.phi, effective, exact.log_evidence, space))
    return tuple(found)


@cache
def change(discrepancy: float) -> Change:
    chosen = settings(discrepancy=discrepancy)
    index = [np.arange(PHASES)] * 2
    both = visits_model(models(), index, chosen.shares.of(models()[0].settings.prior.names), discrepancy)
    return infer_change(both, own(), chosen, 3, "person")


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
    stiffer = FACTOR**2
    shown = -1
    assert found.ratios.low[shown] < stiffer < found.ratios.high[shown]
    assert found.ratios.risen[shown] > RULE.probability
    assert (found.ratios.sd_log < apart.ratios.sd_log).all()


def test_three_visits_are_no_pair_to_compare() -> None:
    chosen = settings()
    three = visits_model([*models(), models()[0]], [np.arange(PHASES)] * 3, np.zeros(4), 0.0)
    with pytest.raises(ValueError, match="3 visits: a change is between two"):
        infer_change(three, own(), chosen, 1)


def test_shares_are_of_the_parameters_named_and_zero_of_all_others() -> None:
    names = speed_case.settings("calibrated").prior.names
    shares = SharesSettings.from_plain(NOTHING | {"passive_ratio": 0.5, "discrepancy": 0.7})
    found = dict(zip(names, shares.of(names), strict=True))
    assert found.pop("passive_ratio") == 0.5
    assert set(found.values()) == {0.0}
