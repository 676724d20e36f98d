"""Stages: one judges recordings by one variant's networks, one puts all judgements together."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from studies.statements.judge import JudgedSettings, Network, chosen, findings, recoveries
from studies.statements.recorded import rerecorded
from studies.statements.settings import StatementsSettings
from studies.statements.table import readings_table, scores_table, stability_table
from swesbi.artefacts import Origin
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.artefacts.typed import BySubject, read_as
from swesbi.heart.prior_simulations import PriorSimulations
from swesbi.measurement.likelihood import measured_subjects
from swesbi.measurement.operator import PassiveBaseline
from swesbi.networks.paper.estimator import Checkpoints
from swesbi.networks.paper.pool import Pool
from swesbi.recording.observation import Observation
from swesbi.report.paper.comparison import score_in_words, statements_table
from swesbi.report.paper.values import read_paper

LOGGER = logging.getLogger("swesbi")


def judged(
    *,
    observations: Sequence[Path],
    passives: Sequence[Path],
    pools: Sequence[Path],
    checkpoints: Sequence[Path],
    shards: Sequence[Path],
    statements: Path,
    settings: JudgedSettings,
    origin: Origin,
) -> None:
    """Score the paper's statements by one variant's networks, on recordings of each acquisition seed.

    Args:
        observations: The shipped recordings, of the main experiment's subjects.
        passives: Their passive baselines, in the same order.
        pools: Training sets, of the experiments in their order.
        checkpoints: Networks, likewise.
        shards: Prior simulations, of all these experiments.
        statements: Output: a row an acquisition and statement.
        settings: Of the stages, and the reading.
        origin: With the study's seed.

    Raises:
        ArtefactError: An input does not fit the others, or a subject is no virtual volunteer.
        RecordingError: A new recording does not pass quality control.
        PassiveCalibrationError: A new recording's late diastole admits no positive passive scale.
    """
    subjects = measured_subjects(
        [Observation.read(path) for path in observations],
        read_as(BySubject[PassiveBaseline], passives, "passives"),
        settings.recorded.measurement,
    )
    networks = {
        name: _network(pool, checkpoint, shards, name, settings)
        for name, pool, checkpoint in zip(settings.experiments, pools, checkpoints, strict=True)
    }
    recovered = recoveries(networks, subjects, settings, origin.seed)
    tables = []
    for acquisition in settings.acquisitions:
        recordings = [rerecorded(each, acquisition, settings.reading, settings.recorded) for each in subjects]
        found = findings(recordings, networks, recovered, settings, origin.seed)
        table = statements_table(read_paper(), found)
        LOGGER.info("%s, acquisition %d: %s", statements.stem, acquisition, score_in_words(table))
        tables.append(table.assign(acquisition=acquisition))
    write_csv(statements, pd.concat(tables, ignore_index=True))


def _network(
    pool: Path, checkpoints: Path, shards: Sequence[Path], experiment: str, settings: JudgedSettings
) -> Network:
    """Read one experiment's network; a reading's epoch is that of the main experiment alone."""
    data, nets = Pool.read(pool), Checkpoints.read(checkpoints)
    best = settings.reading.model_copy(update={"epoch": "best"})
    net = chosen(nets.of_epochs, settings.reading if experiment == settings.main else best)
    data.check_components(net.components, "checkpoints")
    prior = settings.priors[experiment]
    own = [path for path in shards if path.parent.parent.name == prior]
    return Network(data, net, read_as(BySubject[PriorSimulations], own, "shards"))


def tables(
    *,
    judgements: Sequence[Path],
    scores: Path,
    stability: Path,
    readings: Path,
    settings: StatementsSettings,
    origin: Origin,
) -> None:
    """Put the judgements together; each file is named by its variant.

    Args:
        judgements: Of all variants.
        scores: Output, a row a training and acquisition.
        stability: Output, a row a statement: in how many of these it agrees, and the range of its numbers.
        readings: Output, a row a reading: which statements it moves.
        settings: Of the study.
        origin: Not used: nothing is drawn.
    """
    by_variant: Mapping[str, pd.DataFrame] = {path.stem: read_csv(path) for path in judgements}
    found = scores_table(by_variant)
    write_csv(scores, found)
    write_csv(stability, stability_table(by_variant))
    write_csv(readings, readings_table(by_variant, settings))
    LOGGER.info(
        "%.1f of %d statements agree, mean of %d", found["agree"].mean(), found["of"].max(), len(found)
    )
