"""What natural waves told of the virtual volunteers that have nothing else: the table of their README.

    swesbi new-subject --cohort data/virtual_push_trains --all --out answers
    python benchmarks/natural_waves.py answers
    python -m swesbi.virtual_cohort.push_trains data/virtual_push_trains

Reads the answers to those with natural waves alone and writes ``natural_waves.csv`` beside the recordings:
how many speeds each was inferred from, the standard deviation of each quantity's logarithm, posterior over
prior, in brackets where the answer calls it uninformative, the status, and of how many of the four parameters
the 90 % interval holds the truth. The last command shows it in the README.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from swesbi.checks.free_predictive import read_free_predictive
from swesbi.draws import median_and_interval
from swesbi.parameters import PHI_NAMES
from swesbi.posterior.result import read_exact_result
from swesbi.verdict.answers import UNINFORMATIVE
from swesbi.verdict.contraction import CONTRACTION
from swesbi.verdict.support import Support, SupportTest, read_support
from swesbi.virtual_cohort.files import write_csv
from swesbi.virtual_cohort.natural_waves import BETWEEN, TOLD

COHORT = Path("data/virtual_push_trains")


def main() -> None:
    """Write the table of the answers in a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("answers", type=Path, help="folder of `new-subject --all --out`")
    folder: Path = parser.parse_args().answers
    truth = pd.read_csv(COHORT / "truth.csv", index_col="subject")[list(PHI_NAMES)]
    table = pd.DataFrame([_row(folder / subject, truth.loc[subject]) for subject in BETWEEN])
    write_csv(COHORT / TOLD, table)
    print(table.to_string(index=False))


def _row(answer: Path, truth: pd.Series[float]) -> dict[str, object]:
    support, result = read_support(answer / "support.json"), read_exact_result(answer / "posterior.h5")
    low, _, high = median_and_interval(result.phi[:, : len(truth)], result.interval_mass)
    inside = (low <= truth.to_numpy()) & (truth.to_numpy() <= high)
    speeds = len(read_free_predictive(answer / "predictive.h5").phase)
    first = {"subject": answer.name, "speeds": speeds}
    return first | _ratios(support) | {"status": support.status, "truth_inside": int(inside.sum())}


def _ratios(support: Support) -> dict[str, object]:
    told = [test for test in support.tests if test.name.startswith(CONTRACTION)]
    return {test.name.removeprefix(CONTRACTION): _shown(test) for test in told}


def _shown(test: SupportTest) -> str:
    ratio = f"{test.statistic:.2f}"
    return f"({ratio})" if UNINFORMATIVE in test.detail else ratio


if __name__ == "__main__":
    main()
