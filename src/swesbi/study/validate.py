"""Check a cohort of recordings: every problem at once, or a summary of what it holds."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from swesbi.artefacts.atomic import typed
from swesbi.base.terminal import EXIT_REFUSED
from swesbi.config.models import Config
from swesbi.config.read import at_configuration, in_words, merged_files, parse_config, read_merged
from swesbi.recording.cohort.check import CohortReport, examine_cohort, summary
from swesbi.recording.cohort.files import SUBJECTS
from swesbi.recording.problems import Problem, listed
from swesbi.recording.samples import CONFIGURED
from swesbi.recording.settings import RecordingSettings


def main(options: argparse.Namespace) -> int:
    """Run `validate`; return 0, or 2 after listing what must be corrected."""
    options = at_configuration(options)
    cohort, given = options.cohort, (options.config, options.overlay)
    config = parse_config(read_merged(*given), in_words(*given), merged_files(*given))
    settings, where = config.recording, CONFIGURED
    if options.phases is not None:
        where = "--phases"
        settings = RecordingSettings.from_plain(settings.to_plain() | {"phases": options.phases})
    report = examine_cohort(cohort, settings, config.measurement.grid_points, where)
    here = cohort.resolve() == Path(config.cohort).resolve()
    problems = report.problems
    if here and not problems:
        problems = _unknown_subjects(report.usable, config, options.config)
    warnings = [f"warning: {note}" for note in report.notes]
    number = len(report.usable)
    usable = f"{number} recording{'' if number == 1 else 's'} can be used"
    if problems:
        several = "" if len(problems) > 1 else "1 problem\n  - "
        others = [f"{usable} as they are: {', '.join(report.usable)}"] if report.usable else []
        lines = [f"{cohort}: {several}{listed(problems)}", *warnings, *others, "Nothing was written."]
        print("\n".join(lines), file=sys.stderr)
        return EXIT_REFUSED
    print(f"{cohort}: {usable}; origin: {report.origin}")
    print("\n".join([*warnings, "", summary(report)]))
    if not here and number > len(report.free_running):
        print(
            f"note: `{typed('swesbi', 'infer', cohort)}` answers these recordings, and needs no study. "
            f"To train networks on them, set `cohort` of {options.config} to {cohort} and `results` to "
            "another folder, and run the study"
        )
    for note in _notes(report):
        print(f"note: {note}")
    if options.plot:
        _plot(report, options.plot)
    return 0


def _unknown_subjects(known: Sequence[str], config: Config, source: Path) -> tuple[Problem, ...]:
    """Return the subjects that the configuration names and the cohort, whose these are, has not."""
    reason = f"is no subject of {Path(config.cohort) / SUBJECTS}, which has {', '.join(known)}"
    return tuple(
        Problem(str(source), reason, f"correct `{key}`, or write `{key}: all`", column=key, value=name)
        for key, names in config.subject_lists.items()
        for name in names
        if name not in known
    )


def _notes(report: CohortReport) -> Iterator[str]:
    """Yield what can be asked about free-running recordings, and which files are read as they are."""
    if report.free_running:
        yield (
            f"free-running: {', '.join(report.free_running)}; `swesbi infer` answers them. A study needs "
            "gated phases: leave them out of its `subjects`"
        )
    files = dict.fromkeys(one.samples.source for one in report.subjects)
    if others := [name for name in files if not name.lower().endswith(".csv")]:
        yield f"read as they are, without a CSV: {', '.join(others)}"


def _plot(report: CohortReport, folder: Path) -> None:
    # matplotlib is slow to import, and most checks draw nothing
    from swesbi.report.figures.recording import draw_recording_sheet
    from swesbi.report.figures.style import save_figure

    for subject in report.subjects:
        path = folder / f"{subject.observation.subject}.png"
        save_figure(draw_recording_sheet(subject, report.origin), path)
        print(f"wrote {path}")
