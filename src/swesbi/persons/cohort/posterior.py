"""The posterior of the cohort: what the population is like, and each subject within it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import BySubject
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import LOGGER, Progress
from swesbi.base.settings import Settings
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.parameters import OF_THETA
from swesbi.persons.cohort.cohort import make_member
from swesbi.persons.cohort.infer import infer_population, of_theta, redraw_theta, weighted_draws
from swesbi.persons.cohort.stored import CohortPosterior, hyperparameter_table, stored_form, subject_table
from swesbi.persons.settings import HierarchySettings
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.prior import PriorSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.verdict.verdict import Verdict


class VisitSettings(Settings):
    """Whose recording one is: name of the person, and of the person's group; empty where none is given."""

    person: str
    group: str


NOBODY = VisitSettings(person="", group="")


class OfCohort(NamedTuple):
    """The posterior of a cohort, with a row a hyperparameter, and a row a subject and parameter."""

    cohort_posterior: CohortPosterior
    table: PlainTable
    subjects: PlainTable


def posterior_of_cohort(
    posteriors: BySubject[ExactPosterior],
    verdicts: BySubject[Verdict],
    observations: BySubject[Observation],
    noise: CohortNoise,
    *,
    model: SpeedModelSettings,
    exact: ExactSettings,
    cohort_posterior: HierarchySettings,
    visits: dict[str, VisitSettings],
    seed: int,
) -> OfCohort:
    """Infer medians, spreads, slopes and differences of groups from the posteriors of all subjects.

    A person with several visits counts once, with the first of them in the table of subjects.

    ``exact`` is of a posterior that is drawn anew. Raises ValueError where no subject has a posterior, or is
    of the reference group.
    """
    first, notes = first_visits(list(posteriors), visits)
    progress = Progress("posteriors of the cohort", len(first), unit="subject")
    members = []
    for subject in first:
        phi, log_weight = weighted_draws(posteriors[subject])
        members.append(
            make_member(
                observations[subject].context,
                verdicts[subject].status,
                visits.get(subject, NOBODY).group,
                (phi[:, OF_THETA], np.exp(log_weight)),
                (cohort_posterior.draws, cohort_posterior.exact.interval),
                seed,
            )
        )
        progress.step()

    def redraw(subject: str, prior: PriorSettings, seed: int) -> FloatArray:
        LOGGER.info("subject %s: too few recycled draws lie where the population does; drawn anew", subject)
        recorded = speed_model(observations[subject], noise, model)
        return redraw_theta(recorded, weighted_draws(posteriors[subject]), prior, exact, seed)

    quantity = of_theta(model.prior.theta, cohort_posterior.hyperprior)
    stored = stored_form(infer_population(members, quantity, cohort_posterior, redraw, seed), notes)
    _report(stored)
    return OfCohort(stored, hyperparameter_table(stored), subject_table(stored))


def first_visits(
    subjects: Sequence[str], visits: Mapping[str, VisitSettings]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the first recording of each person, in order, and what is to be said of those left out."""
    of_person = {visits.get(subject, NOBODY).person or subject: subject for subject in reversed(subjects)}
    first = tuple(subject for subject in subjects if subject in of_person.values())
    later = [subject for subject in subjects if subject not in first]
    note = f"a person counts once, with the first visit; left out as later visits: {', '.join(later)}"
    return first, (note,) if later else ()


def _report(posterior: CohortPosterior) -> None:
    LOGGER.info(
        "%d subjects: draws by %s; k-hat %.2f, efficiency %.0f %%; drawn anew: %d",
        len(posterior.member), posterior.sampler, posterior.k_hat, 100.0 * posterior.efficiency,
        int((posterior.members.refreshed > 0).sum()),
    )  # fmt: skip
    for sentence in filter(None, (posterior.notes, posterior.reasons)):
        LOGGER.info("  %s", sentence)
