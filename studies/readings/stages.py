"""Readings of the paper's text: each run through the paper's chain, and all set beside its numbers."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from studies.acquisition_seeds.judge import AcquisitionSeedsStageSettings, judged_recordings
from studies.readings.chain import Case, ChainSettings, Row, answer, chosen, reading_pool, train_reading
from studies.readings.comparison import (
    INTERVALS,
    closest,
    given_table,
    readings_table,
    recovery_table,
    seeds_by_reading,
    weights_table,
)
from studies.readings.figure import draw_readings
from studies.readings.recordings import CalibratedSubjectSettings, treated_subject
from studies.readings.recovery import recovery_rows, synthetic_recordings
from studies.readings.settings import CASES, ComparisonSettings, Reading, Treatment, WeightsSettings
from studies.readings.treatment import Features
from studies.readings.weights import fits_by_weights
from swesbi.artefacts import ArtefactError, Origin
from swesbi.artefacts.csv import write_csv
from swesbi.base.settings import Settings
from swesbi.checks.settings import CmaesSettings
from swesbi.heart.prior_simulations import group_by_subject, read_simulations
from swesbi.measurement.likelihood import MeasuredSubject, read_measured_subjects
from swesbi.networks.paper.estimator import Checkpoint, load_checkpoints
from swesbi.networks.paper.pool import Pool, read_pool
from swesbi.prior import PriorSettings
from swesbi.report.figures.style import save_figure
from swesbi.report.paper.values import read_paper
from swesbi.study.stages.inference import check_components

LOGGER = logging.getLogger("swesbi")


class ReadingStageSettings(Settings):
    """What one reading depends on; ``changed`` says that the configuration is not the study's."""

    chain: ChainSettings
    treatment: Treatment
    changed: bool


def readings_run(
    *,
    pool: Path,
    checkpoints: Path,
    observations: Sequence[Path],
    passives: Sequence[Path],
    shards: Sequence[Path],
    numbers: Path,
    settings: ReadingStageSettings,
    origin: Origin,
) -> None:
    """Run the paper's chain under one reading, in memory, and write the numbers that the paper prints.

    The simulations are those of the study. A network is trained where recordings, features or configuration
    differ from the study's; elsewhere its own is taken.

    Raises:
        ArtefactError: An input does not fit the others, or a subject cannot be recorded anew.
        RecordingError: A new recording does not pass quality control.
        PassiveCalibrationError: A new recording's late diastole admits no positive passive scale.
    """
    chain, treatment = settings.chain, settings.treatment
    cases = _cases(observations, passives, shards, settings)
    data, nets = _networks(cases, pool, checkpoints, settings, origin.seed, numbers.stem)
    features, net = _features(settings), chosen(nets, treatment)
    rows = [row for case in cases for row in answer(case, data, net, features, chain, origin.seed)]
    truth, raw = synthetic_recordings(cases, features, chain, origin.seed)
    asked = nets if treatment.other_recovery or _as_published(settings) else (net,)
    rows.extend(recovery_rows(data, asked, truth, raw, chain, origin.seed))
    write_csv(numbers, numbers_frame(rows, net.epoch), float_format=None)
    supported = sum(row.value for row in rows if row.quantity == "supported")
    LOGGER.info("reading %s: %d of %d supported, epoch %d", numbers.stem, supported, len(cases), net.epoch)


def numbers_frame(rows: Sequence[Row], epoch: int) -> pd.DataFrame:
    """Return one row a number; ``chosen`` is 1 where it is of the epoch whose network the reading takes."""
    frame = pd.DataFrame([asdict(row) for row in rows])
    return frame.assign(chosen=(frame["epoch"] == epoch).astype(int))


def _features(settings: ReadingStageSettings) -> Features:
    return Features(settings.chain.summary, settings.treatment, settings.chain.observation_model)


def _as_published(settings: ReadingStageSettings) -> bool:
    return not settings.changed and settings.treatment == Treatment()


def _cases(
    observations: Sequence[Path],
    passives: Sequence[Path],
    shards: Sequence[Path],
    settings: ReadingStageSettings,
) -> list[Case]:
    by_subject = group_by_subject(shards)
    cases = []
    for subject in _subjects(observations, passives, settings.treatment, settings.chain):
        if (name := subject.observation.subject) not in by_subject:
            raise ArtefactError(f"no simulations of subject {name} are given")
        cases.append(Case(subject, read_simulations(by_subject[name])))
    return cases


def _subjects(
    observations: Sequence[Path],
    passives: Sequence[Path],
    treatment: Treatment,
    protocol: CalibratedSubjectSettings,
) -> list[MeasuredSubject]:
    measured = read_measured_subjects(observations, passives, protocol.measurement)
    return [treated_subject(subject, treatment, protocol) for subject in measured]


def _networks(
    cases: Sequence[Case],
    pool: Path,
    checkpoints: Path,
    settings: ReadingStageSettings,
    seed: int,
    label: str,
) -> tuple[Pool, tuple[Checkpoint, ...]]:
    """Return training set and networks of a reading: the study's own where they would be the same."""
    treatment = settings.treatment
    if settings.changed or not (treatment.same_recordings and treatment.same_features):
        data = reading_pool(cases, _features(settings), settings.chain, seed)
        return data, train_reading(data, settings.chain, seed, f"training of reading {label}")
    data, (nets, _) = read_pool(pool), load_checkpoints(checkpoints)
    for net in nets:
        check_components(data, net, checkpoints)
    return data, nets


class ReadingSeedsStageSettings(Settings):
    """What the verdicts of a reading under several acquisition seeds depend on."""

    run: ReadingStageSettings
    judged: AcquisitionSeedsStageSettings


def readings_seeds(
    *,
    pool: Path,
    checkpoints: Path,
    observations: Sequence[Path],
    passives: Sequence[Path],
    shards: Sequence[Path],
    recordings: Path,
    settings: ReadingSeedsStageSettings,
    origin: Origin,
) -> None:
    """Record the volunteers that the paper prints under every acquisition seed, and judge each recording.

    Raises:
        ArtefactError: An input does not fit the others, or a subject is no virtual volunteer.
    """
    run, seed = settings.run, origin.seed
    cases = _cases(observations, passives, shards, run)
    data, nets = _networks(cases, pool, checkpoints, run, seed, recordings.stem)
    subjects = [case.subject for case in cases if case.name in CASES]
    net = chosen(nets, run.treatment)
    write_csv(recordings, judged_recordings(data, net, subjects, shards, settings.judged, seed))


class ReadingsCmaesStageSettings(Settings):
    """What the reference fits under other weights depend on; of the prior only the bounds count."""

    protocol: CalibratedSubjectSettings
    treatment: Treatment
    weights: WeightsSettings
    search: CmaesSettings
    prior: PriorSettings


def readings_cmaes(
    *,
    observations: Sequence[Path],
    passives: Sequence[Path],
    fits: Path,
    settings: ReadingsCmaesStageSettings,
    origin: Origin,
) -> None:
    """Fit recordings of a reading by CMA-ES under every choice of the loss's weights: those the paper prints.

    Raises:
        ArtefactError: An input does not fit the others, or a subject cannot be recorded anew.
    """
    rows = [
        asdict(row)
        for subject in _subjects(observations, passives, settings.treatment, settings.protocol)
        if subject.observation.subject in CASES
        for row in fits_by_weights(
            subject, settings.weights, settings.search, settings.prior, settings.protocol.forward_model
        )
    ]
    write_csv(fits, pd.DataFrame(rows), float_format=None)


class ReadingsStageSettings(Settings):
    """What the tables and the figure depend on."""

    cohort_title: str
    comparison: ComparisonSettings
    readings: dict[str, Reading]


def readings(
    *,
    numbers: Sequence[Path],
    seeds: Sequence[Path],
    fits: Sequence[Path],
    table: Path,
    given: Path,
    recovery: Path,
    verdicts: Path,
    weights: Path,
    figure_pdf: Path,
    figure_png: Path,
    settings: ReadingsStageSettings,
    origin: Origin,
) -> None:
    """Set every reading beside the paper's numbers; each file is named by its reading.

    Args:
        numbers: What each reading comes to.
        seeds: Verdicts under several acquisition seeds.
        fits: Best fits of CMA-ES under several weights.
        table: Output, a row a reading, the paper's on top.
        given: Output, a row a printed number, with the readings that give it.
        recovery: Output, a row a reading and checkpoint.
        verdicts: Output, a row a reading and subject.
        weights: Output, a row a reading and choice of weights.
        figure_pdf: Output, each printed number by reading.
        figure_png: Output, the same.
        settings: Labels and treatments.
        origin: Not used: nothing is drawn.
    """
    paper, of_reading = read_paper(), _frames(numbers)
    ordered = {name: of_reading[name] for name in settings.readings}
    frame = readings_table(ordered, settings.readings, paper, settings.comparison)
    write_csv(table, frame)
    write_csv(given, given_table(frame, settings.readings, paper, settings.comparison))
    write_csv(recovery, recovery_table(ordered, settings.readings))
    write_csv(verdicts, seeds_by_reading(_frames(seeds), settings.readings))
    write_csv(weights, weights_table(_frames(fits), ordered, settings.readings))
    save_figure(
        draw_readings(frame, paper, settings.comparison, settings.cohort_title), figure_pdf, figure_png
    )
    best, interval = closest(frame)
    LOGGER.info("closest to all that the paper prints: %s, by the %s", best["label"], INTERVALS[interval])


def _frames(paths: Sequence[Path]) -> Mapping[str, pd.DataFrame]:
    return {path.stem: pd.read_csv(path) for path in paths}
