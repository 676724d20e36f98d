"""The exact posterior of a recording that no network knows, by importance sampling from the prior on."""

from __future__ import annotations

from dataclasses import replace

from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.exact import ExactPosterior, certified
from swesbi.posterior.importance import LikelihoodModel
from swesbi.posterior.settings import ExactSettings
from swesbi.seeds import integer_seed


def posterior_from_prior(
    model: LikelihoodModel, settings: ExactSettings, seed: int, *name: str | int
) -> ExactPosterior:
    """Draw from the exact posterior of a recording, with the same certificate as any.

    Where the weights of the last round are not reliable, MCMC started from them takes over. In the place of a
    network's draws it has those of the prior.

    Args:
        model: Prior and exact likelihood of the recording.
        settings: Sizes and criteria.
        seed: Seed of everything.
        name: Names the streams.

    Raises:
        NoLikelihoodError: The likelihood is zero at every draw of the prior.
    """
    for adapted in adaptive_rounds(model, settings, integer_seed(seed, *name, "rounds")):
        last = adapted.weighted
    exact = certified(model, last, settings, integer_seed(seed, *name, "exact"))
    return replace(exact, npe_phi=last.phi[last.from_prior][: settings.draws])
