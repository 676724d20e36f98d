"""Stages: one judges recordings by one variant's networks, one puts all judgements together."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import NamedTuple

import pandas as pd
from pydantic import JsonValue

from studies.statements.judge import Network, chosen, findings, recoveries
from studies.statements.recorded import RecordedSettings, rerecorded
from studies.statements.recovery import ExperimentSettings
from studies.statements.settings import Reading
from studies.statements.table import readings_table, scores_table, stability_table
from swesbi.artefacts.csv import PlainTable
from swesbi.artefacts.typed import ByExperiment, ByName, BySubject, Files, Item
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.networks.paper.estimator import Checkpoints
from swesbi.networks.paper.pool import Pool
from swesbi.recording.observation import Observation
from swesbi.report.paper.comparison import score_in_words, statements_table
from swesbi.report.paper.values import read_paper

LOGGER = logging.getLogger("swesbi")


class ByPrior(Files[str, Item]):
    """Simulations from several priors."""

    @staticmethod
    def key(path: Path) -> str:
        """Return the prior in whose folder those of a subject lie."""
        return path.parent.parent.name


def judged(
    observations: tuple[Observation, ...],
    passives: BySubject[PassiveBaseline],
    pools: ByExperiment[Pool],
    checkpoints: ByExperiment[Checkpoints],
    shards: ByPrior[BySubject[PriorSimulations]],
    *,
    variant: str,
    cohort_title: str,
    main: str,
    experiments: dict[str, ExperimentSettings],
    priors: dict[str, str],
    cmaes: dict[str, JsonValue],
    recorded: RecordedSettings,
    acquisitions: tuple[int, ...],
    reading: Reading,
    seed: int,
) -> PlainTable:
    """Score the paper's statements by one variant's networks: a row an acquisition and statement.

    Args:
        observations: The shipped recordings, of the main experiment's subjects.
        checkpoints: A reading chooses the epoch of the main experiment's.
        experiments: What posterior, predictive check and recovery of each depend on, the main one first.
        priors: The name of each experiment's prior.
        cmaes: Of the reference fit.
        acquisitions: Seeds of the recordings.

    Raises:
        ArtefactError: An input does not fit the others, or a subject is no virtual volunteer.
        RecordingError: A new recording does not pass quality control.
        PassiveCalibrationError: A new recording's late diastole admits no positive passive scale.
    """
    subjects = measured_subjects(observations, passives, recorded.measurement)
    networks = {}
    for name, own in experiments.items():
        pool, nets = pools[name], checkpoints[name].of_epochs
        net = chosen(nets, reading.epoch if name == main else "best")
        pool.check_components(net.components, "checkpoints")
        networks[name] = Network(own, pool, net, shards[priors[name]])
    recovered = recoveries(networks, subjects, reading.recovery, recorded.passive.exponent_b, seed)
    tables = []
    for acquisition in acquisitions:
        recordings = [rerecorded(each, acquisition, reading, recorded) for each in subjects]
        found = findings(recordings, networks, recovered, main, cmaes, cohort_title, seed)
        table = statements_table(read_paper(), found)
        LOGGER.info("%s, acquisition %d: %s", variant, acquisition, score_in_words(table))
        tables.append(table.assign(acquisition=acquisition))
    return pd.concat(tables, ignore_index=True)


class Tables(NamedTuple):
    """All judgements: a row a training and acquisition, a row a statement, and a row a reading."""

    scores: PlainTable
    stability: PlainTable
    readings: PlainTable


def tables(judgements: ByName[PlainTable], *, labels: dict[str, str]) -> Tables:
    """Put the judgements together.

    Args:
        labels: What each reading is called, in the order shown.
    """
    by_variant = dict(judgements)
    scores = scores_table(by_variant)
    LOGGER.info(
        "%.1f of %d statements agree, mean of %d", scores["agree"].mean(), scores["of"].max(), len(scores)
    )
    return Tables(scores, stability_table(by_variant), readings_table(by_variant, labels))
