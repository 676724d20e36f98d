"""Stage: prior support and posterior of one subject."""

from __future__ import annotations

import logging
from pathlib import Path

from swesbi.artefacts import ArtefactError, save, write_json
from swesbi.inference.dataset import POSTERIOR, posterior_to_groups, read_pool
from swesbi.inference.estimator import load_estimator
from swesbi.inference.pool import Pool
from swesbi.inference.posterior import summarise_posterior
from swesbi.inference.sampling import Sampler, draw_candidates
from swesbi.inference.settings import PosteriorSettings, SupportSettings
from swesbi.inference.support import diagnose
from swesbi.prior import PriorSettings
from swesbi.seeds import integer_seed
from swesbi.settings import Settings
from swesbi.stages.origin import Origin

LOGGER = logging.getLogger("swesbi")


class PosteriorStageSettings(Settings):
    """What support and posterior depend on, beside pool and estimator."""

    prior: PriorSettings
    support: SupportSettings
    posterior: PosteriorSettings


def run(
    *,
    pool: Path,
    estimator: Path,
    posterior: Path,
    support: Path,
    settings: PosteriorStageSettings,
    origin: Origin,
) -> None:
    """Draw candidates for ``origin.subject``, judge its prior support, keep the draws within the prior.

    A subject that is not supported keeps its draws, if it has any, and its verdict.

    Raises:
        ArtefactError: The estimator was trained on other components than the pool's.
    """
    subject = origin.subject
    data, (trained, _) = read_pool(pool), load_estimator(estimator)
    check_components(data, trained, estimator)
    z_obs, names = data.observed_z(subject), data.components.names
    seed = integer_seed(origin.seed, "posterior", subject)
    candidates = draw_candidates(trained, z_obs[None], settings.support.candidate_draws, seed)[0]
    verdict = diagnose(z_obs, names, candidates, settings.prior, settings.support)
    summary = summarise_posterior(candidates, z_obs, names, settings.prior, settings.posterior)
    save(posterior, posterior_to_groups(summary), origin.provenance(POSTERIOR, settings))
    write_json(support, verdict.to_json())
    LOGGER.info("subject %s: %s", subject, verdict.verdict)


def check_components(pool: Pool, estimator: Sampler, path: Path) -> None:
    """Refuse an estimator that was trained on other components than the pool's.

    Raises:
        ArtefactError: Names or order of the components differ.
    """
    if estimator.components != pool.components.names:
        raise ArtefactError(
            f"{path}: takes the components {', '.join(estimator.components)}; "
            f"the pool holds {', '.join(pool.components.names)}. Train on this pool"
        )
