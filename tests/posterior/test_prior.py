import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.stats import kstest, truncnorm

from swesbi.parameters import ParameterPrior
from swesbi.prior import PriorSettings, bounds, in_bounds, log_centre, log_density, quantile

PAPER = PriorSettings(
    k0_kpa=ParameterPrior(centre=45.0, log_sd=0.5, low=10.0, high=200.0),
    k_atp_per_s=ParameterPrior(centre=5.0, log_sd=0.6, low=2.0, high=30.0),
    k_sr_per_s=ParameterPrior(centre=30.0, log_sd=0.45, low=2.0, high=60.0),
)


def test_quantile_maps_the_unit_cube_onto_the_box() -> None:
    low, high = bounds(PAPER)
    theta = quantile(np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]]), PAPER)
    np.testing.assert_allclose(theta, [low, high], rtol=1e-12)
    assert in_bounds(theta, PAPER).all()


@pytest.mark.parametrize("j", range(3))
def test_draws_follow_the_truncated_log_normal(j: int) -> None:
    theta = quantile(np.random.default_rng(0).random((4000, 3)), PAPER)
    part = PAPER.parameters[j]
    a, b = (np.log([part.low, part.high]) - np.log(part.centre)) / part.log_sd
    assert kstest(np.log(theta[:, j]), truncnorm(a, b, np.log(part.centre), part.log_sd).cdf).pvalue > 0.01
    wrong = truncnorm(a, b, np.log(part.centre) + 0.05, part.log_sd)
    assert kstest(np.log(theta[:, j]), wrong.cdf).pvalue < 0.01


@pytest.mark.parametrize("j", range(3))
def test_density_integrates_to_one_along_each_parameter(j: int) -> None:
    centre = log_centre(PAPER)
    low, high = bounds(PAPER)

    def density(value: float) -> float:
        theta = centre.copy()
        theta[j] = value
        return np.exp(log_density(theta[None], PAPER)[0])

    others = np.exp(log_density(centre[None], PAPER)[0]) / density(centre[j])
    total = quad(density, low[j], high[j], limit=200)[0]
    rest = [quad(lambda v, i=i: np.exp(_marginal(v, i)), low[i], high[i])[0] for i in range(3)]
    assert others == pytest.approx(1.0)
    np.testing.assert_allclose(rest, 1.0, rtol=1e-8)
    assert total == pytest.approx(np.exp(sum(_marginal(centre[i], i) for i in range(3) if i != j)), rel=1e-6)


def _marginal(value: float, j: int) -> float:
    part = PAPER.parameters[j]
    a, b = (np.log([part.low, part.high]) - np.log(part.centre)) / part.log_sd
    return truncnorm(a, b, np.log(part.centre), part.log_sd).logpdf(np.log(value)) - np.log(value)


def test_density_is_zero_outside_the_box() -> None:
    theta = np.array([[9.9, 5.0, 30.0], [45.0, 31.0, 30.0], [45.0, 5.0, -1.0]])
    assert np.all(log_density(theta, PAPER) == -np.inf)


def test_impossible_bounds_are_refused() -> None:
    with pytest.raises(ValidationError, match="low < centre < high"):
        ParameterPrior(centre=5.0, log_sd=0.5, low=6.0, high=10.0)
