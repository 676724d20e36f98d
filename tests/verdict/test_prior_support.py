import json
from dataclasses import replace
from pathlib import Path

import arviz
import h5py
import numpy as np
import pytest
import xarray as xr
from inference_case import PAPER_PRIOR
from pydantic import ValidationError

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.parameters import THETA_NAMES
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict

NAMES = ("maximum_kpa", "max_up_slope_kpa_per_cycle", "age_years")
Z_OBS = np.array([0.5, -1.2, 2.16])
SETTINGS = SupportSettings(max_abs_z=3.0, min_in_prior_draws=1000, candidate_draws=500_000)
KEPT = PosteriorSettings(draws=400, unfiltered_draws=300, interval=0.9)
KEYS = (
    "status sentence reasons max_abs_z worst_component in_prior_draws candidate_draws acceptance "
    "unfiltered_median sha256"
)


def candidates(inside: int, outside: int) -> np.ndarray:
    """Draws of which exactly ``inside`` are in the prior's bounds, mixed in order."""
    rng = np.random.default_rng(0)
    theta = rng.normal([50.0, 8.0, 30.0], [2.0, 0.5, 1.0], size=(inside + outside, 3))
    theta[rng.permutation(inside + outside)[:outside], 1] += 60.0
    return theta


def judged(inside: int, outside: int, z_obs: np.ndarray = Z_OBS) -> Verdict:
    return diagnose(z_obs, NAMES, candidates(inside, outside), PAPER_PRIOR, SETTINGS)


def test_enough_draws_at_the_limit_of_z_are_prior_supported() -> None:
    verdict = judged(1000, 500, np.array([0.0, -3.0, 2.0]))
    assert verdict.may_be_read
    assert verdict.reasons == ()
    assert (verdict.max_abs_z, verdict.worst_component) == (3.0, "max_up_slope_kpa_per_cycle")
    assert verdict.status == "prior-supported"
    assert verdict.sentence.startswith("prior-supported: max |z| = 3.00")


def test_one_draw_too_few_is_not() -> None:
    verdict = judged(999, 501)
    assert not verdict.may_be_read
    assert verdict.reasons == ("999 of 1500 candidate draws lie within the prior's bounds, 1000 required",)
    assert verdict.status == "not prior-supported"
    assert verdict.sentence.startswith("not prior-supported: 999 of 1500")


def test_leakage_names_the_medians_beyond_the_bounds() -> None:
    verdict = judged(1, 5000)
    assert (verdict.in_prior_draws, verdict.candidate_draws) == (1, 5001)
    assert verdict.acceptance == pytest.approx(1 / 5001)
    assert verdict.unfiltered_median["k_atp_per_s"] == pytest.approx(68.0, abs=0.1)
    assert "median of k_atp_per_s 68.0 outside [2, 30]" in verdict.reasons[0]


def test_far_component_is_named_though_the_draws_suffice() -> None:
    verdict = judged(2000, 0, np.array([-3.2, 3.14, 0.0]))
    assert not verdict.may_be_read
    assert verdict.reasons == (
        "2 of 3 components outside what the prior predicts, |z| <= 3 required: "
        "maximum_kpa (z = -3.20), max_up_slope_kpa_per_cycle (z = 3.14)",
    )


def test_nan_never_counts_as_support() -> None:
    theta = candidates(3000, 0)
    theta[:2500, 0] = np.nan
    assert diagnose(Z_OBS, NAMES, theta, PAPER_PRIOR, SETTINGS).in_prior_draws == 500
    z_obs = np.array([0.0, np.nan, 0.0])
    assert not diagnose(z_obs, NAMES, candidates(3000, 0), PAPER_PRIOR, SETTINGS).may_be_read


def test_the_file_has_the_fixed_keys_and_reads_back(tmp_path: Path) -> None:
    verdict, path = judged(1, 5000), tmp_path / "verdict.json"
    verdict.write(path, Provenance(""))
    assert list(json.loads(path.read_text())) == KEYS.split()
    assert Verdict.read(path) == verdict
    path.write_text("{}")
    with pytest.raises(ArtefactError, match=r"verdict\.json"):
        Verdict.read(path)


def test_settings_that_no_subject_can_meet_are_refused() -> None:
    with pytest.raises(ValidationError, match="cannot be met by candidate_draws = 10"):
        SupportSettings(max_abs_z=3.0, min_in_prior_draws=11, candidate_draws=10)


def posterior_of(inside: int, outside: int) -> Posterior:
    return summarise_posterior(candidates(inside, outside), Z_OBS, NAMES, PAPER_PRIOR, KEPT)


def test_posterior_keeps_the_first_draws_in_bounds() -> None:
    theta = candidates(900, 300)
    posterior = posterior_of(900, 300)
    np.testing.assert_array_equal(posterior.theta, theta[theta[:, 1] < 30.0][:400])
    np.testing.assert_array_equal(posterior.unfiltered, theta[:300])
    np.testing.assert_array_equal(posterior.unfiltered_in_prior, theta[:300, 1] < 30.0)


def test_posterior_summary_is_that_of_the_kept_draws() -> None:
    rng = np.random.default_rng(3)
    covariance = np.array([[4.0, -0.9 * 2 * 0.5, 0.0], [-0.9 * 2 * 0.5, 0.25, 0.0], [0.0, 0.0, 1.0]])
    theta = rng.multivariate_normal([50.0, 8.0, 30.0], covariance, size=40_000)
    kept = KEPT.model_copy(update={"draws": 40_000})
    posterior = summarise_posterior(theta, Z_OBS, NAMES, PAPER_PRIOR, kept)
    np.testing.assert_allclose(posterior.median, [50.0, 8.0, 30.0], atol=0.05)
    expected = 1.6449 * np.array([2.0, 0.5, 1.0])
    np.testing.assert_allclose(posterior.interval[:, 1] - posterior.median, expected, rtol=0.05)
    np.testing.assert_allclose(posterior.median - posterior.interval[:, 0], expected, rtol=0.05)
    assert posterior.correlation[0, 1] == pytest.approx(-0.9, abs=0.01)
    assert posterior.correlation[0, 2] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("inside", [0, 1, 350])
def test_posterior_file_reads_back_by_us_xarray_h5py_and_arviz(tmp_path: Path, inside: int) -> None:
    posterior, path = posterior_of(inside, 500), tmp_path / "posterior.h5"
    posterior.write(path, Provenance("", "A"))
    back = Posterior.read(path)
    for name in ("theta", "unfiltered", "unfiltered_in_prior", "median", "interval", "correlation", "z_obs"):
        np.testing.assert_array_equal(getattr(back, name), getattr(posterior, name), err_msg=name)
    assert back.component_names == NAMES
    with h5py.File(path) as file:
        assert file["posterior/k0_kpa"].shape == (1, inside)
        assert file["posterior/k0_kpa"].attrs["units"] == "kPa"
        assert [dimension[0].name for dimension in file["posterior/k0_kpa"].dims] == [
            "/posterior/chain",
            "/posterior/draw",
        ]
    with xr.open_dataset(path, group="posterior", engine="h5netcdf") as group:
        assert dict(group.sizes) == {"chain": 1, "draw": inside}
    inference_data = arviz.from_netcdf(str(path), engine="h5netcdf")
    assert list(inference_data.posterior.data_vars) == list(THETA_NAMES)
    assert inference_data.posterior["k_atp_per_s"].shape == (1, inside)


def test_without_draws_the_summary_is_nan_not_a_number() -> None:
    empty = posterior_of(0, 500)
    assert (
        np.isnan(empty.median).all() and np.isnan(empty.interval).all() and np.isnan(empty.correlation).all()
    )
    assert np.isnan(posterior_of(2, 500).correlation).all()
    assert np.isfinite(posterior_of(2, 500).median).all()


def test_equal_posteriors_give_equal_bytes(tmp_path: Path) -> None:
    paths = [tmp_path / "one.h5", tmp_path / "two.h5"]
    for path in paths:
        replace(posterior_of(300, 10)).write(path, Provenance("", "A"))
    assert paths[0].read_bytes() == paths[1].read_bytes()
