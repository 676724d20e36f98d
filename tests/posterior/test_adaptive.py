"""Importance sampling that adapts from the prior on, against posteriors that are known."""

from __future__ import annotations

import numpy as np
import pytest
from exact_case import PRIOR, SETTINGS, ToyModel, check_posterior, known_log_evidence

from swesbi.posterior.adaptive import AdaptedDraws, adapted, adaptive_rounds
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.prior import in_bounds


def last(model: ToyModel, seed: int = 1) -> AdaptedDraws:
    return adapted(model, SETTINGS, seed)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_finds_the_known_posterior_and_evidence(seed: int) -> None:
    found = last(ToyModel(), seed)
    weighted = found.weighted
    assert found.reliable
    check_posterior(weighted.phi, weighted.efficiency * len(weighted.phi), weighted.weight)
    assert weighted.log_evidence == pytest.approx(known_log_evidence(), abs=4.0 * weighted.log_evidence_se)


def test_every_draw_of_every_round_counts_and_lies_within_the_prior() -> None:
    rounds = list(adaptive_rounds(ToyModel(), SETTINGS, 1))
    sizes = [len(found.weighted.phi) for found in rounds]
    assert sizes[0] == SETTINGS.first_draws
    assert sizes == sorted(set(sizes))
    assert [found.reliable for found in rounds] == [False] * (len(rounds) - 1) + [True]
    weighted = rounds[-1].weighted
    assert in_bounds(weighted.phi, PRIOR).all()
    assert weighted.weight.sum() == pytest.approx(1.0)
    assert weighted.from_prior.sum() == SETTINGS.first_draws
    np.testing.assert_array_equal(weighted.phi[: sizes[-2]], rounds[-2].weighted.phi)


def test_simulations_that_fail_have_no_weight() -> None:
    limit = 60.0
    weighted = last(ToyModel(fails_above=limit)).weighted
    assert np.isneginf(weighted.log_likelihood[weighted.phi[:, 0] > limit]).all()
    assert weighted.weight[weighted.phi[:, 0] > limit].sum() < 1e-9


def test_it_ends_where_weights_never_become_reliable() -> None:
    impossible = SETTINGS.model_copy(update={"effective_draws": 10**9})
    rounds = list(adaptive_rounds(ToyModel(), impossible, 1))
    assert len(rounds) == SETTINGS.max_rounds + 1
    assert not rounds[-1].reliable


def test_a_heart_that_no_parameters_simulate_is_an_error() -> None:
    with pytest.raises(NoLikelihoodError, match="none of 1000 draws has a likelihood"):
        last(ToyModel(fails_above=0.0))
