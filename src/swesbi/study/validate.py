"""Check a cohort of recordings: every problem at once, or a summary of what it holds."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from swesbi.artefacts.atomic import typed
from swesbi.config.models import Config
from swesbi.config.read import at_configuration, in_words, merged_files, parse_config, read_merged
from swesbi.recording.cohort.check import CohortReport, examine_cohort, summary
from swesbi.recording.cohort.files import SUBJECTS
from swesbi.recording.problems import Problem, listed
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import RecordingSettings

EXIT_PROBLEMS = 2


def main(options: argparse.Namespace) -> int:
    """Run `validate`; return 0, or 2 after listing what must be corrected.

    Raises:
        ConfigError: The configuration itself is wrong.
    """
    options = at_configuration(options)
    cohort: Path = options.cohort
    source = in_words(options.config, options.overlay)
    files = merged_files(options.config, options.overlay)
    config = parse_config(read_merged(options.config, options.overlay), source, files)
    settings, where = config.recording, CONFIGURED
    if options.phases is not None:
        where = "--phases"
        settings = RecordingSettings.from_plain(settings.to_plain() | {"phases": options.phases})
    report = examine_cohort(cohort, settings, config.measurement.grid_points, where)
    here = cohort.resolve() == Path(config.cohort).resolve()
    problems = (*report.problems, *(_unknown_subjects(report, config, options.config) if here else ()))
    if problems:
        several = "" if len(problems) > 1 else "1 problem\n  - "
        usable = [f"{_usable(report)} as they are: {', '.join(report.usable)}"] if report.usable else []
        lines = [
            f"{cohort}: {several}{listed(problems)}",
            *_warnings(report),
            *usable,
            "Nothing was written.",
        ]
        print("\n".join(lines), file=sys.stderr)
        return EXIT_PROBLEMS
    print(f"{cohort}: {_usable(report)}; origin: {report.origin}")
    print("\n".join([*_warnings(report), "", summary(report)]))
    gated = len(report.usable) > len(report.free_running)
    elsewhere = (_elsewhere(cohort, options.config),) if gated and not here else ()
    for note in (*elsewhere, *_free_running(report), *_other_files(report)):
        print(f"note: {note}")
    if options.plot:
        _plot(report, options.plot)
    return 0


def _usable(report: CohortReport) -> str:
    number = len(report.usable)
    return f"{number} recording{'' if number == 1 else 's'} can be used"


def _warnings(report: CohortReport) -> list[str]:
    """Say which files are of nobody, before all that is said of the others."""
    return [f"warning: {note}" for note in report.notes]


def _unknown_subjects(report: CohortReport, config: Config, source: Path) -> list[Problem]:
    """Return the subjects that the configuration names and the cohort has not."""
    known = report.usable
    if report.problems:
        return []
    reason = f"is no subject of {Path(config.cohort) / SUBJECTS}, which has {', '.join(known)}"
    return [
        Problem(str(source), reason, f"correct `{key}`, or write `{key}: all`", column=key, value=name)
        for key, names in _lists(config).items()
        for name in names
        if name not in known
    ]


def _lists(config: Config) -> Mapping[str, Sequence[str]]:
    """Return every list of subjects of the configuration that is of its cohort, by its key."""
    of_study = {"subjects": () if config.subjects == "all" else config.subjects}
    listed = {name: config.listed_subjects(name) for name in config.experiments}
    return of_study | {f"experiments.{name}.subjects": names or () for name, names in listed.items()}


def _elsewhere(cohort: Path, source: Path) -> str:
    return (
        f"`{typed('swesbi', 'infer', cohort)}` answers these recordings, and needs no study. To train "
        f"networks on them, set `cohort` of {source} to {cohort} and `results` to another "
        "folder, and run the study"
    )


def _free_running(report: CohortReport) -> tuple[str, ...]:
    """Say what can be asked about free-running recordings, if there are any."""
    if not report.free_running:
        return ()
    return (
        f"free-running: {', '.join(report.free_running)}; `swesbi infer` answers them without a network. "
        "Networks and the experiments of the paper need gated phases: leave them out of `subjects` of a "
        "study",
    )


def _other_files(report: CohortReport) -> tuple[str, ...]:
    """Name the files that are read in place of ``SUBJECT.csv``, if there are any."""
    files = dict.fromkeys(one.samples.source for one in report.subjects)
    others = [name for name in files if not name.lower().endswith(".csv")]
    return (f"read as they are, without a CSV: {', '.join(others)}",) if others else ()


def _plot(report: CohortReport, folder: Path) -> None:
    # matplotlib is slow to import, and most checks draw nothing
    from swesbi.report.figures.free_recording import draw_free_sheet
    from swesbi.report.figures.recording import draw_recording_sheet
    from swesbi.report.figures.style import save_figure

    for subject in report.subjects:
        path = folder / f"{subject.observation.subject}.png"
        draw = draw_recording_sheet if subject.observation.is_gated else draw_free_sheet
        save_figure(draw(subject, report.origin), path)
        print(f"wrote {path}")
