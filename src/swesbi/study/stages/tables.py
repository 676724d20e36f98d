"""The tables of every experiment, as CSV and LaTeX, and of true parameters."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import atomic_path
from swesbi.base import Settings
from swesbi.checks.cmaes import read_cmaes
from swesbi.checks.predictive import read_predictive
from swesbi.checks.recovery import read_truth
from swesbi.posterior.truncated import read_posterior
from swesbi.show.csv import write_csv
from swesbi.show.latex import posterior_latex, ppc_latex
from swesbi.show.study_tables import Answer, Case, features_table, posterior_table, ppc_table, truth_table
from swesbi.study.stages.origin import Origin, by_key, by_subject, pick
from swesbi.verdict.answers import verdict_numbers
from swesbi.verdict.support import read_support

LOGGER = logging.getLogger("swesbi")


class TablesSettings(Settings):
    """What the tables call the subjects."""

    cohort_title: str


def tables(
    *,
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    cmaes: Sequence[Path],
    ppc_csv: Path,
    ppc_tex: Path,
    features_csv: Path,
    posterior_csv: Path,
    posterior_tex: Path,
    settings: TablesSettings,
    origin: Origin,
) -> None:
    """Write the tables; every experiment and subject whose predictive check is given has its rows."""
    cases = read_cases(predictives, posteriors, supports, cmaes)
    scores = ppc_table(cases)
    reasons = {(case.experiment, case.subject): ", ".join(verdict_numbers(case.support)) for case in cases}
    write_csv(ppc_csv, scores)
    write_csv(features_csv, features_table(cases))
    posteriors_in_numbers = posterior_table(cases)
    write_csv(posterior_csv, posteriors_in_numbers)
    _write_text(ppc_tex, ppc_latex(scores, reasons, settings.cohort_title))
    _write_text(posterior_tex, posterior_latex(posteriors_in_numbers, reasons, settings.cohort_title))


def read_cases(
    predictives: Sequence[Path],
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    cmaes: Sequence[Path],
) -> list[Case]:
    """Read what the tables need, in the order of ``predictives``.

    Raises:
        ArtefactError: A subject's posterior or verdict is missing, or a file cannot be read.
    """
    posterior_of, support_of, fit_of = by_key(posteriors), by_key(supports), by_subject(cmaes)
    return [
        Case(
            key.experiment,
            key.subject,
            read_predictive(path)[0],
            read_posterior(pick(posterior_of, key, "posterior")),
            read_support(pick(support_of, key, "support verdict")),
            read_cmaes(fit_of[key.subject])[0],
        )
        for key, path in by_key(predictives).items()
    ]


def _write_text(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


class TruthSettings(Settings):
    """Nothing of the configuration: the table says what the posteriors and the truth say."""


def truth(
    *,
    posteriors: Sequence[Path],
    supports: Sequence[Path],
    truth: Path,
    truth_csv: Path,
    settings: TruthSettings,
    origin: Origin,
) -> None:
    """Write the table of every experiment and subject whose posterior is given.

    Raises:
        ArtefactError: A verdict is missing, or a file cannot be read.
    """
    support_of = by_key(supports)
    answers = [
        Answer(
            key.experiment,
            key.subject,
            read_posterior(path),
            read_support(pick(support_of, key, "support verdict")),
        )
        for key, path in by_key(posteriors).items()
    ]
    table = truth_table(answers, read_truth([truth]))
    write_csv(truth_csv, table)
    for experiment, part in table.dropna(subset="inside").groupby("experiment", sort=False):
        inside = part["inside"].astype(bool)
        LOGGER.info("%s: %d of %d true parameters inside", experiment, inside.sum(), len(inside))
