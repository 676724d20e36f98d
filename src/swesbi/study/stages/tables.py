"""The tables of every experiment, of true parameters, and of the paper's numbers, as CSV and LaTeX."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import Origin, atomic_path
from swesbi.artefacts.csv import read_csv, write_csv
from swesbi.base.settings import Settings
from swesbi.checks.cmaes import CmaesFit
from swesbi.checks.predictive import read_predictive
from swesbi.checks.recovery import read_truth
from swesbi.checks.settings import CmaesSettings, PredictiveSettings, RecoverySettings
from swesbi.networks.paper.pool import read_pool
from swesbi.networks.settings import EstimatorSettings, ObservationModelSettings
from swesbi.posterior.truncated import read_posterior
from swesbi.prior import PriorSettings
from swesbi.recording.cohort.recording_file import read_recording_file
from swesbi.recording.observation import Observation
from swesbi.recording.settings import RecordingSettings
from swesbi.report import study_tables
from swesbi.report.figures.training import read_history
from swesbi.report.latex import comparison_latex, posterior_latex, ppc_latex
from swesbi.report.paper.comparison import comparison_table, score_in_words, statements_table
from swesbi.report.paper.measured import StudyResults, pool_size
from swesbi.report.paper.values import read_paper
from swesbi.study.stages.origin import by_key, by_subject, pick
from swesbi.verdict.settings import SupportSettings
from swesbi.verdict.verdict import read_verdict

LOGGER = logging.getLogger("swesbi")


class TablesSettings(Settings):
    """What the tables call the subjects."""

    cohort_title: str


def tables(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    cmaes: Sequence[Path],
    ppc_csv: Path,
    ppc_tex: Path,
    features_csv: Path,
    posterior_csv: Path,
    posterior_tex: Path,
    settings: TablesSettings,
    origin: Origin,
) -> None:
    """Write the tables of every experiment; who has a predictive check among the given has rows."""
    cases = read_cases(predictives, posteriors, verdicts, cmaes)
    scores = study_tables.ppc_table(cases)
    judged = {(case.experiment, case.subject): case.verdict for case in cases}
    write_csv(ppc_csv, scores)
    write_csv(features_csv, study_tables.features_table(cases))
    posteriors_in_numbers = study_tables.posterior_table(cases)
    write_csv(posterior_csv, posteriors_in_numbers)
    _write_text(ppc_tex, ppc_latex(scores, judged, settings.cohort_title))
    _write_text(posterior_tex, posterior_latex(posteriors_in_numbers, judged, settings.cohort_title))


def read_cases(
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    cmaes: Sequence[Path],
) -> list[study_tables.Case]:
    """Read what the tables need, in the order of ``predictives``.

    Raises:
        ArtefactError: A subject's posterior or verdict is missing, or a file cannot be read.
    """
    posterior_of, verdict_of, fit_of = by_key(posteriors), by_key(verdicts), by_subject(cmaes)
    return [
        study_tables.Case(
            key.experiment,
            key.subject,
            read_predictive(path)[0],
            read_posterior(pick(posterior_of, key, "posterior")),
            read_verdict(pick(verdict_of, key, "verdict")),
            CmaesFit.read(fit_of[key.subject]),
        )
        for key, path in by_key(predictives).items()
    ]


def _write_text(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


class TruthSettings(Settings):
    """Nothing of the configuration: the table has what posteriors and truth have."""


def truth(
    *,
    posteriors: Sequence[Path],
    verdicts: Sequence[Path],
    truth: Path,
    truth_csv: Path,
    settings: TruthSettings,
    origin: Origin,
) -> None:
    """Write the table of every experiment and subject whose posterior is given.

    Raises:
        ArtefactError: A verdict is missing, or a file cannot be read.
    """
    verdict_of = by_key(verdicts)
    answers = (
        (key.experiment, key.subject, read_posterior(path), read_verdict(pick(verdict_of, key, "verdict")))
        for key, path in by_key(posteriors).items()
    )
    table = study_tables.truth_table(answers, read_truth([truth]))
    write_csv(truth_csv, table)
    for experiment, part in table.dropna(subset="inside").groupby("experiment", sort=False):
        inside = part["inside"].astype(bool)
        LOGGER.info("%s: %d of %d true parameters inside", experiment, inside.sum(), len(inside))


class ComparedExperimentSettings(Settings):
    """The parts of the main experiment whose numbers the paper prints."""

    prior: PriorSettings
    observation_model: ObservationModelSettings
    estimator: EstimatorSettings
    support: SupportSettings
    predictive: PredictiveSettings
    recovery: RecoverySettings


class PaperComparisonSettings(Settings):
    """What is compared beside the results: the main experiment's settings, the search's, the recording's."""

    cohort_title: str
    main_experiment: str
    experiment: ComparedExperimentSettings
    cmaes: CmaesSettings
    recording: RecordingSettings


def paper_comparison(
    *,
    protocol: Path,
    ppc: Path,
    posterior: Path,
    features: Path,
    recoveries: Sequence[Path],
    training: Path,
    pool: Path,
    verdicts: Sequence[Path],
    observations: Sequence[Path],
    cmaes: Sequence[Path],
    comparison_csv: Path,
    comparison_tex: Path,
    statements_csv: Path,
    settings: PaperComparisonSettings,
    origin: Origin,
) -> None:
    """Write one row for every number that the paper prints, and one for every statement on its results.

    ``protocol`` is the cohort's ``recording.yaml``; ``verdicts``, ``training`` and ``pool`` are of the main
    experiment, the other tables of all.

    Raises:
        ArtefactError: A file cannot be read.
    """
    numbers = read_paper()
    study = StudyResults(
        cohort_title=settings.cohort_title,
        main=settings.main_experiment,
        settings=settings.to_plain(),
        protocol=read_recording_file(protocol.parent).protocol.to_plain(),
        ppc=read_csv(ppc),
        posterior=read_csv(posterior),
        features=read_csv(features),
        verdicts={key.subject: read_verdict(path) for key, path in by_key(verdicts).items()},
        recoveries={path.parent.name: read_csv(path) for path in recoveries},
        training=read_history(training),
        pool=pool_size(read_pool(pool)),
        observations=[Observation.read(path) for path in observations],
        fits={subject: CmaesFit.read(path) for subject, path in by_subject(cmaes).items()},
    )
    table = comparison_table(numbers, study)
    write_csv(comparison_csv, table)
    _write_text(comparison_tex, comparison_latex(numbers, table, settings.cohort_title))
    statements = statements_table(numbers, study)
    write_csv(statements_csv, statements)
    LOGGER.info(score_in_words(statements))
