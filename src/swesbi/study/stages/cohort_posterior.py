"""The posterior of the cohort: what the population is like, and each subject within it."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from swesbi.artefacts import Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModelSettings, build_speed_model
from swesbi.parameters import OF_THETA
from swesbi.persons.cohort.anew import drawn_anew, stored_draws
from swesbi.persons.cohort.cohort import Member, make_member
from swesbi.persons.cohort.infer import infer_cohort
from swesbi.persons.cohort.result import KIND, CohortPosterior, population_groups
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.persons.cohort.stored import stored_form
from swesbi.persons.cohort.table import hyperparameter_table, subject_table
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.study.stages.origin import by_key
from swesbi.verdict.verdict import read_verdict

LOGGER = logging.getLogger("swesbi")


class VisitSettings(Settings):
    """Whose recording one is: name of the person, and of the person's group; empty where none is given."""

    person: str
    group: str


class CohortPosteriorStageSettings(Settings):
    """What the posterior of a cohort depends on beside those of its subjects."""

    model: SpeedModelSettings
    exact: ExactSettings
    cohort_posterior: HierarchySettings
    visits: dict[str, VisitSettings]


def cohort_posterior(
    *,
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    observations: Sequence[Path],
    noise: Path,
    cohort_posterior: Path,
    table: Path,
    subjects: Path,
    settings: CohortPosteriorStageSettings,
    origin: Origin,
) -> None:
    """Infer medians, spreads, slopes and differences of groups from the posteriors of all subjects.

    A person with several visits counts once, with the first of them in the table of subjects.

    Raises:
        ArtefactError: An input is no such artefact.
        NoLikelihoodError: No draw has a likelihood.
        ValueError: No subject has a posterior.
    """
    first, notes = first_visits([path.parent.name for path in posteriors], settings.visits)
    posterior_of = {path.parent.name: path for path in posteriors}
    verdict_of = {key.subject: path for key, path in by_key(verdicts).items()}
    observation_of = {path.parent.name: path for path in observations}
    progress = Progress("posteriors of the cohort", len(first), unit="subject")
    members = []
    for subject in first:
        group = settings.visits[subject].group if subject in settings.visits else ""
        members.append(
            _member(
                posterior_of[subject], verdict_of[subject], observation_of[subject], group, settings, origin
            )
        )
        progress.step()
    of_cohort = CohortNoise.read(noise)

    def redraw(subject: str, prior: PriorSettings, seed: int) -> FloatArray:
        LOGGER.info("subject %s: too few recycled draws lie where the population does; drawn anew", subject)
        model = build_speed_model(observation_of[subject], of_cohort, settings.model)
        return drawn_anew(model, stored_draws(posterior_of[subject]), prior, settings.exact, seed)

    theta_prior = settings.model.prior.theta
    inferred = infer_cohort(members, theta_prior, settings.cohort_posterior, redraw, origin.seed)
    _write(stored_form(inferred, notes), cohort_posterior, table, subjects, settings, origin)


def first_visits(
    subjects: Sequence[str], visits: Mapping[str, VisitSettings]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the first recording of each person, in order, and what is to be said of those left out."""
    seen: dict[str, str] = {}
    later = []
    for subject in subjects:
        person = (visits[subject].person if subject in visits else "") or subject
        if seen.setdefault(person, subject) != subject:
            later.append(subject)
    if not later:
        return tuple(subjects), ()
    note = f"a person counts once, with the first visit; left out as later visits: {', '.join(later)}"
    return tuple(seen.values()), (note,)


def _member(
    posterior: Path,
    verdict: Path,
    observation: Path,
    group: str,
    settings: CohortPosteriorStageSettings,
    origin: Origin,
) -> Member:
    phi, log_weight = stored_draws(posterior)
    hierarchy = settings.cohort_posterior
    return make_member(
        Observation.read(observation).context,
        read_verdict(verdict).status,
        group,
        (phi[:, OF_THETA], np.exp(log_weight)),
        (hierarchy.draws, hierarchy.exact.interval),
        origin.seed,
    )


def _write(
    posterior: CohortPosterior,
    path: Path,
    hyperparameters: Path,
    subjects: Path,
    settings: CohortPosteriorStageSettings,
    origin: Origin,
) -> None:
    save(path, population_groups(posterior), origin.provenance(KIND, settings))
    write_csv(hyperparameters, hyperparameter_table(posterior))
    write_csv(subjects, subject_table(posterior))
    LOGGER.info(
        "%d subjects: draws by %s; k-hat %.2f, efficiency %.0f %%; drawn anew: %d",
        len(posterior.subject), posterior.sampler, posterior.k_hat, 100.0 * posterior.efficiency,
        int((posterior.subjects.refreshed > 0).sum()),
    )  # fmt: skip
    for sentence in filter(None, (posterior.notes, posterior.reasons)):
        LOGGER.info("  %s", sentence)
