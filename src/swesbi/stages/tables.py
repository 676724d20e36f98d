"""Stage: the tables of every experiment, as CSV and LaTeX."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from swesbi.artefacts import atomic_path
from swesbi.evaluation.cmaes_dataset import read_cmaes
from swesbi.evaluation.predictive_dataset import read_predictive
from swesbi.evaluation.verdict import verdict_numbers
from swesbi.inference.dataset import read_posterior
from swesbi.inference.support import read_support
from swesbi.settings import Settings
from swesbi.show.csv import write_csv
from swesbi.show.latex import posterior_latex, ppc_latex
from swesbi.show.study_tables import Case, features_table, posterior_table, ppc_table
from swesbi.stages.origin import Origin
from swesbi.stages.places import by_place, by_subject, pick


class TablesSettings(Settings):
    """What the tables call the subjects."""

    cohort_title: str


def run(
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
    posterior_of, support_of, fit_of = by_place(posteriors), by_place(supports), by_subject(cmaes)
    return [
        Case(
            place.experiment,
            place.subject,
            read_predictive(path)[0],
            read_posterior(pick(posterior_of, place, "posterior")),
            read_support(pick(support_of, place, "support verdict")),
            read_cmaes(fit_of[place.subject])[0],
        )
        for place, path in by_place(predictives).items()
    ]


def _write_text(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
