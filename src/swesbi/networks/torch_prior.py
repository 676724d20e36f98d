"""A prior as a torch distribution."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.distributions import Distribution, constraints

from swesbi.prior import BoxPrior, bounds, log_centre

LOG_ROOT_TWO_PI = 0.5 * float(np.log(2.0 * np.pi))


class TruncatedLogNormal(Distribution):
    """Independent log-normals, each truncated to an interval and normalised there (paper, Sec. 2.4).

    The support is the closed box of the bounds, so sbi knows what lies outside the prior; sampling
    inverts the distribution function.
    """

    arg_constraints: dict[str, constraints.Constraint] = {}  # noqa: RUF012 - torch declares it so

    def __init__(self, centre: Tensor, log_sd: Tensor, low: Tensor, high: Tensor) -> None:
        self._mean, self._sd = centre.double().log(), log_sd.double()
        self._low, self._high = low.float(), high.float()
        self._alpha = (low.double().log() - self._mean) / self._sd
        self._beta = (high.double().log() - self._mean) / self._sd
        self._cdf_low = torch.special.ndtr(self._alpha)
        self._mass = torch.special.ndtr(self._beta) - self._cdf_low
        super().__init__(event_shape=centre.shape, validate_args=False)

    @property
    def support(self) -> constraints.Constraint:
        """The box of the bounds."""
        box = constraints.interval(self._low, self._high)  # type: ignore[no-untyped-call]
        return constraints.independent(box, 1)  # type: ignore[no-untyped-call]

    @property
    def mean(self) -> Tensor:
        """Expectation of each parameter."""
        return self._moment(1).float()

    @property
    def variance(self) -> Tensor:
        """Variance of each parameter."""
        return (self._moment(2) - self._moment(1) ** 2).float()

    def sample(self, sample_shape: torch.Size | list[int] | tuple[int, ...] = ()) -> Tensor:
        """Draw parameters of shape (*sample_shape, d) by inverting the distribution function."""
        return self.icdf(
            torch.rand(
                torch.Size(sample_shape) + self.event_shape, dtype=torch.float64, device=self._low.device
            )
        )

    def icdf(self, value: Tensor) -> Tensor:
        """Map uniforms of shape (..., d) to parameters."""
        standard = torch.special.ndtri(self._cdf_low + value.double() * self._mass)
        theta = torch.exp(self._mean + self._sd * standard).float()
        return torch.minimum(torch.maximum(theta, self._low), self._high)

    def log_prob(self, value: Tensor) -> Tensor:
        """Return the log density per unit of theta, summed over the parameters; -inf outside the box."""
        inside = (value >= self._low) & (value <= self._high)
        log_theta = torch.log(torch.where(inside, value, self._low).double())
        standard = (log_theta - self._mean) / self._sd
        density = -0.5 * standard**2 - LOG_ROOT_TWO_PI - torch.log(self._sd * self._mass) - log_theta
        return torch.where(inside, density, -torch.inf).sum(-1).float()

    def _moment(self, order: int) -> Tensor:
        """Raw moment E[theta^k] = exp(k m + k^2 s^2 / 2) [Phi(b - k s) - Phi(a - k s)] / mass."""
        shift = order * self._sd
        mass = torch.special.ndtr(self._beta - shift) - torch.special.ndtr(self._alpha - shift)
        moment: Tensor = torch.exp(order * self._mean + 0.5 * shift**2) * mass / self._mass
        return moment


def torch_prior(prior: BoxPrior, device: str = "cpu") -> TruncatedLogNormal:
    """Return a prior as a torch distribution on ``device``, as sbi expects one."""
    log_sd = np.array([parameter.log_sd for parameter in prior.parameters])
    tensors = [
        torch.as_tensor(values, device=device) for values in (log_centre(prior), log_sd, *bounds(prior))
    ]
    return TruncatedLogNormal(*tensors)
