"""How the answers to the virtual trial lie about what truly changed, and which changes were called.

    .venv/bin/swesbi compare --cohort data/virtual_trial --all --experiment amortised
    .venv/bin/python benchmarks/trial_answers.py --out docs/tables/trial_answers.csv

A row a quantity and group: persons, true mean ratio, intervals that contain the person's own ratio, changes
called, the median of the smallest detectable change.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from swesbi.artefacts.csv import write_csv

TRIAL = Path("data/virtual_trial")
CHANGES = Path("results/amortised/change/changes.csv")


def true_ratios(folder: Path) -> pd.DataFrame:
    """Return each person's true ratio, later over earlier, by column of the truth; indexed by person."""
    truth = pd.read_csv(folder / "truth.csv").set_index(["person", "visit"])
    later, earlier = (truth.xs(visit, level="visit") for visit in ("after", "before"))
    numbers = later.select_dtypes("number").columns
    return (later[numbers] / earlier[numbers]).assign(group=later["group"])


def rows_of(answers: pd.DataFrame, truth: pd.DataFrame) -> pd.DataFrame:
    """Return a row a quantity and group."""
    of_person = answers.assign(
        true_1=[truth.loc[p, q] for p, q in zip(answers.person, answers.quantity, strict=True)],
        group=truth.loc[answers.person, "group"].to_numpy(),
    )
    within = of_person.ratio_low_1.le(of_person.true_1) & of_person.true_1.le(of_person.ratio_high_1)
    judged = of_person.assign(covered=within, log_true=np.log(of_person.true_1))
    table = judged.groupby(["quantity", "group"], sort=False).agg(
        persons=("person", "size"),
        true_mean_ratio_1=("log_true", "mean"),
        covered=("covered", "sum"),
        called=("changed", "sum"),
        smallest_detectable_change_1=("smallest_detectable_change_1", "median"),
    )
    return table.assign(true_mean_ratio_1=np.exp(table.true_mean_ratio_1)).reset_index()


def main() -> None:
    """Read answers and truth, print the table and write it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--changes", type=Path, default=CHANGES, help="default: %(default)s")
    parser.add_argument("--out", type=Path, help="table to write")
    options = parser.parse_args()
    table = rows_of(pd.read_csv(options.changes), true_ratios(TRIAL))
    print(table.to_string(index=False, float_format="%.3g"))
    if options.out:
        write_csv(options.out, table)


if __name__ == "__main__":
    main()
