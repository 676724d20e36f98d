"""What has changed in groups of persons with two visits, from the joint posterior of each."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from swesbi.artefacts import Origin, save
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.persons.change.groups import infer_change_groups, lacking_draws, member_of_change, unlike_pairs
from swesbi.persons.change.settings import ChangeGroupsSettings
from swesbi.persons.change.stored import read_change
from swesbi.persons.change.stored_groups import (
    KIND,
    change_groups_table,
    change_persons_table,
    stored_groups,
)
from swesbi.persons.change.words import group_lines
from swesbi.persons.cohort.result import population_groups
from swesbi.persons.cohort.settings import HierarchySettings
from swesbi.prior import JointPriorSettings
from swesbi.recording.observation import Observation
from swesbi.report.figures.change_groups import draw_change_groups
from swesbi.report.figures.style import save_figure

LOGGER = logging.getLogger("swesbi")


class ChangeGroupsStageSettings(Settings):
    """What the change in groups depends on beside the changes of its persons."""

    prior: JointPriorSettings
    change_groups: ChangeGroupsSettings
    cohort_posterior: HierarchySettings
    groups: dict[str, str]
    left_out: tuple[str, ...]
    cohort_title: str


def change_groups(
    *,
    changes: Sequence[Path],
    observations: Sequence[Path],
    groups: Path,
    table: Path,
    persons: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: ChangeGroupsStageSettings,
    origin: Origin,
) -> None:
    """Infer mean and spread of what has changed in the persons with two visits, and how their groups differ.

    Args:
        changes: ``change.h5`` of each person.
        observations: Observed curve of each person's earlier visit, in the same order.
        groups: Output, ``changes_groups.h5``.
        table: Output, a row a hyperparameter.
        persons: Output, a row a person and parameter.
        figure_pdf: Output.
        figure_png: Output.

    Raises:
        ArtefactError: An input is no such artefact.
        ValueError: There is nobody.
    """
    asked, effort = settings.change_groups, settings.cohort_posterior
    read = [read_change(path) for path in changes]
    members = [
        member_of_change(
            change,
            replace(Observation.read(observation).context, subject=change.person),
            settings.groups.get(change.person, ""),
            asked,
            effort.exact.interval,
            origin.seed,
        )
        for change, observation in zip(read, observations, strict=True)
    ]
    inferred = infer_change_groups(members, settings.prior.theta, asked, effort, origin.seed)
    notes = (*settings.left_out, *unlike_pairs(read), *lacking_draws(inferred, asked.least_effective))
    stored = stored_groups(inferred, notes)
    save(groups, population_groups(stored), origin.provenance(KIND, settings))
    write_csv(table, change_groups_table(stored))
    write_csv(persons, change_persons_table(stored))
    save_figure(draw_change_groups(stored, settings.cohort_title), figure_pdf, figure_png)
    for line in group_lines(stored):
        LOGGER.info("%s", line)
