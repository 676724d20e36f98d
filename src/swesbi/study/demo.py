"""Answer the shipped recording of G, a virtual volunteer whose parameters are known, without a study."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Final

import numpy as np

from swesbi.checks.truths import Truths
from swesbi.config.read import CONFIGURATION, at_configuration, installation, read_merged
from swesbi.config.study import load_study
from swesbi.parameters import THETA, THETA_NAMES
from swesbi.report.sheet import Sheet
from swesbi.study.answerer import Answerer, experiments_to_ask
from swesbi.verdict.answer_lines import ANSWER_LINES

SUBJECT: Final = "G"
COHORT: Final = "data/virtual_volunteers"


def main(options: argparse.Namespace) -> int:
    """Run `demo`; return 0 after printing what came out, in six lines, and where it lies."""
    began = time.monotonic()
    options.config = options.config or installation() / CONFIGURATION
    options = at_configuration(options)
    study = load_study(read_merged(options.config), new_cohort=Path(COHORT))
    asked = Answerer(study, experiments_to_ask(study, None), "").request(SUBJECT)
    _, page = asked.answer_into(options.out, force=True)
    print("\n".join(_lines(page)))
    print(f"figures, page and arrays: {options.out.resolve()} ({time.monotonic() - began:.0f} s)")
    return 0


def _lines(page: Sheet) -> list[str]:
    """Return what came out: six lines."""
    truth = Truths.read(Path(COHORT) / "truth.csv")[SUBJECT]
    low, median, high = page.limits
    rows = {line.parameter.name: number for number, line in enumerate(ANSWER_LINES)}
    mass = f"{100.0 * page.result.interval_mass:.0f} %"
    made = page.recorded
    lines = [f"{SUBJECT}: {made.summary}, {made.accepted} samples; errors: {made.noise}"]
    for parameter, true in zip(THETA, truth, strict=True):
        at = rows[parameter.name]
        inside = "contains" if low[at] <= true <= high[at] else "does not contain"
        lines.append(
            f"{parameter.text:5} {median[at]:6.1f} {parameter.unit}, {mass} interval {low[at]:.1f} to "
            f"{high[at]:.1f}: {inside} the true {true:g}"
        )
    return [*lines, f"verdict: {page.verdict.sentence}", f"limit: {_limit(page)}"]


def _limit(page: Sheet) -> str:
    """Return how much narrower more repeats would make the intervals, and what they would not change."""
    if page.more is None:
        return "the posterior has not converged; do not use it"
    rows = [number for number, line in enumerate(ANSWER_LINES) if line.parameter.name in THETA_NAMES]
    left = float(np.mean(page.more.width[-1, rows]))
    return (
        f"with {page.more.times[-1]:g} times as many repeats the intervals would keep {100.0 * left:.0f} % "
        "of their width; the rest comes from unknown properties of the heart and the scale of the speeds"
    )
