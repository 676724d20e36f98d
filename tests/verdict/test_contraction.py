from __future__ import annotations

import numpy as np
import pytest

from swesbi.verdict.contraction import contractions
from swesbi.verdict.settings import UninformativeSettings
from swesbi.verdict.verdict import Status, Verdict

RULE = UninformativeSettings(sd_ratio=0.9, shift=0.25)
RNG = np.random.default_rng(7)
PRIOR = {"k_atp_per_s": np.exp(0.6 * RNG.standard_normal(4000))}


def told(log_sd: float, shift: float) -> bool:
    posterior = {"k_atp_per_s": np.exp(shift + log_sd * RNG.standard_normal(4000))}
    (found,) = contractions(posterior, PRIOR, RULE).of_each
    assert abs(found.sd_ratio - log_sd / 0.6) < 0.05
    return found.uninformative


def test_a_posterior_that_is_the_prior_is_uninformative() -> None:
    assert told(0.6, 0.0)
    assert told(0.58, 0.1)


def test_one_that_is_narrower_or_elsewhere_is_not() -> None:
    assert not told(0.45, 0.0)
    assert not told(0.6, 0.4)


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_draws_without_a_beat_or_a_logarithm_are_left_out(value: float) -> None:
    some = PRIOR["k_atp_per_s"].copy()
    some[:300] = value
    (found,) = contractions({"k_atp_per_s": some}, PRIOR, RULE).of_each
    assert found.uninformative


def test_a_recording_is_uninformative_where_every_quantity_is() -> None:
    same = {name: PRIOR["k_atp_per_s"] for name in ("k0_kpa", "k_atp_per_s")}
    narrow = same | {"k0_kpa": same["k0_kpa"] ** 0.3}
    all_same, one_told = (contractions(draws, same, RULE) for draws in (same, narrow))
    assert all_same.uninformative
    assert not one_told.uninformative
    assert one_told.in_words == "posterior over prior sd of the log: k_0 0.30; k_ATP 1.00, uninformative"
    assert not any(one.test(RULE.sd_ratio).flagged for one in one_told.of_each)


@pytest.mark.parametrize("status", Status)
def test_only_a_recording_that_fits_is_called_uninformative(status: Status) -> None:
    expected = Status.UNINFORMATIVE if status.fits else status
    judged = Verdict(1.0, "", 1, 1, {}, status, f"{status}: so", ())
    found = contractions(PRIOR, PRIOR, RULE).beside(judged)
    assert found.status == expected
    assert found.sentence.startswith(expected)
    narrow = contractions({"k_atp_per_s": PRIOR["k_atp_per_s"] ** 0.3}, PRIOR, RULE).beside(judged)
    assert (narrow.status, narrow.sentence, narrow.reasons) == (status, judged.sentence, ())
