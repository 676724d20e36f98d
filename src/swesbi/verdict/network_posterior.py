"""The posterior of one subject by the network of an experiment on features, and its prior support."""

from __future__ import annotations

from typing import NamedTuple

from swesbi.base.progress import LOGGER
from swesbi.networks.paper.draws import draw_candidates
from swesbi.networks.paper.estimator import TrainedEstimator
from swesbi.networks.paper.pool import Pool
from swesbi.posterior.settings import PosteriorSettings
from swesbi.posterior.truncated import Posterior, summarise_posterior
from swesbi.prior import PriorSettings
from swesbi.seeds import integer_seed
from swesbi.verdict.prior_support import diagnose
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import Verdict


class PosteriorVerdict(NamedTuple):
    """The posterior of a subject, and the verdict on its prior support."""

    posterior: Posterior
    verdict: Verdict


def judged_posterior(
    pool: Pool,
    estimator: TrainedEstimator,
    *,
    subject: str,
    prior: PriorSettings,
    support: SupportSettings,
    posterior: PosteriorSettings,
    seed: int,
) -> PosteriorVerdict:
    """Draw candidates for a subject, judge its prior support, keep the draws within the prior.

    A subject that is not prior-supported keeps its draws, if it has any, and its verdict.

    Raises:
        UnfitError: The estimator was trained on other components than the pool's.
        KeyError: The pool holds no such subject.
    """
    pool.check_components(estimator.components, "estimator")
    z_obs, names = pool.observed_z(subject), pool.components.names
    drawn_by = integer_seed(seed, "posterior", subject)
    candidates = draw_candidates(estimator, z_obs[None], support.candidate_draws, drawn_by)[0]
    verdict = diagnose(z_obs, names, candidates, prior, support)
    LOGGER.info("subject %s: %s", subject, verdict.sentence)
    return PosteriorVerdict(summarise_posterior(candidates, z_obs, names, prior, posterior), verdict)
