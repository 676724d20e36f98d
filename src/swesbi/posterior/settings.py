"""Settings of the posteriors: the draws of the paper, the exact posterior, MCMC."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from swesbi.base.settings import Level, Settings


class McmcSettings(Settings):
    """The ensemble sampler that takes over where importance weights fail."""

    ensembles: int = Field(ge=4, description="independent ensembles, each a chain of R-hat")
    walkers: int = Field(ge=16, description="walkers of an ensemble; even")
    steps: int = Field(ge=10, description="steps of each walker in a round; rounds follow until both are met")
    max_steps: int = Field(ge=10, description="steps after which a sampler that has not converged gives up")
    warm_up_fraction: float = Field(ge=0.1, lt=1.0, description="first share of all steps, left out")
    max_r_hat: float = Field(gt=1.0, description="largest rank-normalised split R-hat of a converged sampler")
    min_effective_draws: int = Field(ge=1, description="least effective draws of a converged sampler")

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        if self.walkers % 2:
            raise ValueError(f"walkers = {self.walkers}: an ensemble moves in halves; take an even number")
        if self.max_steps < self.steps:
            raise ValueError(f"max_steps = {self.max_steps} is less than one round, steps = {self.steps}")
        return self

    @property
    def start_points(self) -> int:
        """Walkers of all ensembles together."""
        return self.ensembles * self.walkers

    @property
    def least_draws(self) -> int:
        """Draws that are left of one round without its warm-up."""
        return self.start_points * (self.steps - warm_up_steps(self.steps, self.warm_up_fraction))


class ExactSettings(Settings):
    """Rounds of weighted draws, the criteria of their weights, and what is kept."""

    first_draws: int = Field(ge=100, description="draws of the first round, each simulated and weighted")
    prior_fraction: float = Field(gt=0.0, lt=1.0, description="share of them drawn from the prior")
    round_draws: int = Field(
        ge=100, description="draws of a further round, of a proposal fitted to all before"
    )
    max_rounds: int = Field(ge=0, description="further rounds at most, before MCMC")
    effective_draws: int = Field(ge=10, description="effective draws at which rounds end")
    min_effective_draws: int = Field(ge=1, description="least effective draws of a posterior by weights")
    max_k_hat: float = Field(gt=0.0, le=1.0, description="of the Pareto shape, and 1 - 1/log10(draws)")
    draws: int = Field(ge=1, description="equally weighted draws that are kept")
    interval: float = Field(gt=0.0, lt=1.0, description="mass of the equal-tailed credible interval")
    mcmc: McmcSettings

    @model_validator(mode="after")
    def _check_draws(self) -> Self:
        if self.draws > self.mcmc.least_draws:
            raise ValueError(
                f"draws = {self.draws}, but a round of the sampler leaves only {self.mcmc.least_draws}; "
                "raise mcmc.steps or lower draws"
            )
        if self.effective_draws < self.min_effective_draws:
            raise ValueError(
                f"effective_draws = {self.effective_draws} is less than min_effective_draws = "
                f"{self.min_effective_draws}: rounds would end before their weights are accepted"
            )
        return self


DRAWS_AN_EFFECTIVE_ONE = 5
"""Draws of a network for one that is effective: the networks' efficiency is 12 to 20 % in the median."""


def asking(settings: ExactSettings, effective_draws: int) -> ExactSettings:
    """Return the same criteria for a posterior of which so many effective draws are enough.

    Chains that take over end with as many, or after one round: they begin with weighted draws.
    """
    least = min(settings.min_effective_draws, effective_draws)
    first = min(settings.first_draws, max(100, DRAWS_AN_EFFECTIVE_ONE * effective_draws))
    mcmc = settings.mcmc
    shorter = {
        "min_effective_draws": min(mcmc.min_effective_draws, effective_draws),
        "max_steps": mcmc.steps,
    }
    changed = {
        "effective_draws": effective_draws,
        "min_effective_draws": least,
        "first_draws": first,
        "mcmc": mcmc.model_copy(update=shorter),
    }
    return settings.model_copy(update=changed)


def warm_up_steps(steps: int, fraction: float) -> int:
    """Return how many of the first steps are left out."""
    return round(fraction * steps)


class PosteriorSettings(Settings):
    """What is kept of the candidates, and the credible interval."""

    draws: int = Field(ge=1, description="in-prior draws kept, at most")
    unfiltered_draws: int = Field(ge=1, description="first candidates kept as they came")
    interval: Level = Field(description="mass of the equal-tailed credible interval")
