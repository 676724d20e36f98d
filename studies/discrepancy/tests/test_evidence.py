"""The evidence of pairs (delta, tau): banks of simulations, proposals, what the scores add up to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import logsumexp
from speed_case import PHI, model, model_of_sweeps, settings

from studies.discrepancy.evidence import (
    Bank,
    PairScore,
    PriorProposal,
    discrepancy_table,
    fill_bank,
    score_pairs,
    score_subject,
)
from studies.discrepancy.settings import DiscrepancyStudySettings
from swesbi.draws import effective_draws, normalised
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import PHI_NAMES
from swesbi.population.recordings import own_recordings
from swesbi.posterior.fitted import StudentProposal
from swesbi.virtual.generated import GeneratedSubject

STUDY = DiscrepancyStudySettings(
    subjects=3,
    speed_fractions=(0.0, 0.03),
    timing_cycles=(0.0, 0.015),
    simulations_per_round=800,
    max_rounds=12,
    min_effective_draws=150,
    interval=0.9,
)

SMALL = {"simulations_per_round": 400, "min_effective_draws": 60}


def pair(speed_fraction: float, timing_cycle: float) -> DiscrepancySettings:
    return DiscrepancySettings(speed_fraction=speed_fraction, timing_cycle=timing_cycle)


def test_the_evidence_is_the_mean_likelihood_over_the_prior() -> None:
    """Of a recording with the passive stiffness at the prior's centre, so that its draws reach it."""
    pairs, made = (pair(0.1, 0.0), pair(0.05, 0.02)), model()
    speeds = made.predict(np.array([[*PHI[:3], 4.0]])).speed_m_s[0]
    usual = replace(made, recording=replace(made.recording, speed_m_s=speeds))
    bank = fill_bank(usual, pairs, 1000, 10, 300, np.random.default_rng(1))
    scores = score_pairs(bank, PHI[:3])
    prior = fill_bank(usual, pairs, 15_000, 1, 1, np.random.default_rng(2))
    for index, score in enumerate(scores):
        log_likelihood = prior.log_likelihood[index]
        expected = logsumexp(log_likelihood) - np.log(len(log_likelihood))
        error = np.hypot(1.0 / np.sqrt(effective_draws(normalised(log_likelihood))), score.log_evidence_se)
        assert error < 0.2
        assert abs(score.log_evidence - expected) < 3.0 * error


def test_the_bank_covers_every_pair_and_repeats() -> None:
    first, second = (
        fill_bank(model(), STUDY.pairs, 800, 20, 150, np.random.default_rng(3)) for _ in range(2)
    )
    assert min(effective_draws(normalised(row)) for row in first.log_weights()) >= 150
    np.testing.assert_array_equal(first.log_weights(), second.log_weights())
    assert np.isfinite(first.log_likelihood).any(axis=1).all()


def test_draws_of_a_bank_are_from_where_the_other_half_finds_the_posterior() -> None:
    """A proposal that knew the draws that it weighs would make the tails of the posterior too light."""
    banks = []
    for share in (1.0, 0.5):
        bank = Bank(model(), (pair(0.1, 0.0),))
        bank.extend(PriorProposal(bank.prior), 400, np.random.default_rng(1))
        bank.log_likelihood[:, bank.half == 0] *= share
        bank.extend_towards(0, 100, np.random.default_rng(2))
        banks.append(bank.eta[400:])
    np.testing.assert_array_equal(banks[0][:50], banks[1][:50])
    assert not np.array_equal(banks[0][50:], banks[1][50:])


@pytest.mark.slow(minutes=0.2)
def test_the_bank_covers_every_pair_with_nuisances_too() -> None:
    made = model(prior="calibrated")
    bank = fill_bank(made, STUDY.pairs, 1000, 20, 60, np.random.default_rng(3))
    assert bank.phi.shape[1] == len(made.settings.prior.names) > len(PHI_NAMES)
    assert min(effective_draws(normalised(row)) for row in bank.log_weights()) >= 60


def test_proposals_have_the_density_that_they_are_drawn_from() -> None:
    prior = PriorProposal(settings().prior)
    rng = np.random.default_rng(4)
    eta = prior.draw(50_000, rng)
    wide = StudentProposal(eta.mean(axis=0), 2.0 * np.cov(eta.T))
    drawn = wide.draw(50_000, rng)
    # the mean of p / q under q is one when both are densities
    assert np.exp(prior.log_density(drawn) - wide.log_density(drawn)).mean() == pytest.approx(1.0, abs=0.02)


def test_the_discrepancy_behind_recordings_has_the_highest_evidence() -> None:
    truth = pair(0.03, 0.015)
    grid = STUDY.model_copy(
        update={"speed_fractions": (0.0, 0.03, 0.07), "timing_cycles": (0.0, 0.015, 0.04), **SMALL}
    )
    made = settings().model_copy(update={"discrepancy": truth})
    source = model()
    synthetic = own_recordings(replace(source, settings=made), 8, 8, "discrepancy test")
    scores = [
        score_subject(GeneratedSubject(recording, phi[:3]), settings(), grid, np.random.default_rng(index))
        for index, (recording, phi) in enumerate(zip(synthetic.recordings, synthetic.phi, strict=True))
    ]
    table = discrepancy_table(grid.pairs, scores, [20] * 8, 0.9)
    by_pair = table.set_index(["speed_fraction", "timing_cycle"])
    assert by_pair["log_evidence"].idxmax() == (truth.speed_fraction, truth.timing_cycle)
    assert by_pair.loc[(0.0, 0.0), "below_best"] > 50.0
    assert by_pair.loc[(0.0, 0.0), "mean_chi2"] > 40.0
    assert by_pair.loc[(0.03, 0.015), "mean_chi2"] == pytest.approx(17.0, abs=6.0)  # 20 phases, 4 parameters
    covered = [f"coverage_{name}" for name in ("k0_kpa", "k_atp_per_s", "k_sr_per_s")]
    assert by_pair.loc[(0.03, 0.015), covered].mean() > 0.75
    assert by_pair.loc[(0.0, 0.0), covered].mean() < 0.6


def test_a_bank_holds_the_likelihood_of_the_speed_model() -> None:
    pairs = (model().settings.discrepancy, pair(0.01, 0.005))
    for case in (model(), model_of_sweeps()):
        bank = Bank(case, pairs)
        bank.extend(PriorProposal(bank.prior), 20, np.random.default_rng(1))
        for index, discrepancy in enumerate(pairs):
            exact = replace(case, settings=case.settings.model_copy(update={"discrepancy": discrepancy}))
            np.testing.assert_allclose(bank.log_likelihood[index], exact.log_likelihood(bank.phi))


def score(level: float, evidence: float) -> PairScore:
    return PairScore(evidence, 0.1, np.full(3, level), 20.0, 500.0)


def test_the_table_adds_up() -> None:
    pairs = (pair(0.0, 0.0), pair(0.03, 0.015))
    scores = [(score(0.99, 1.0), score(0.5, 4.0)), (score(0.96, 2.0), score(0.06, 3.0))]
    table = discrepancy_table(pairs, scores, [20, 19], 0.9)
    assert table["log_evidence"].tolist() == [3.0, 7.0]
    assert table["below_best"].tolist() == [4.0, 0.0]
    assert table["below_best_se"].tolist() == pytest.approx([np.sqrt(2.0) * np.std([3.0, 1.0], ddof=1), 0.0])
    assert table["coverage_k0_kpa"].tolist() == [0.0, 1.0]
    assert table["log_evidence_se"].tolist() == pytest.approx([np.sqrt(0.02)] * 2)
    assert table["best"].tolist() == [0, 1]
    assert table["mean_phases"].tolist() == [19.5] * 2
