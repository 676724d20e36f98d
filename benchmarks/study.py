"""Where the time of a study goes: processor time, wall time and memory by stage, and what starting up costs.

    python benchmarks/study.py
    python benchmarks/study.py --table docs/tables/study_cost.csv --figure docs/figures/study_cost.png

Adds up the files that Snakemake writes for every job of a run. Start-up is measured here and now: a process
that imports what the stage imports and does nothing, times the number of jobs.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from swesbi.figures.style import new_figure, save_figure, style

TIMES = {"s": "wall_s", "cpu_time": "cpu_s", "max_rss": "memory_mb"}
SHOWN = 16  # stages in the figure, the rest together


def read_jobs(folder: Path) -> pd.DataFrame:
    """Return one row a job: its stage, wall and processor time (s) and largest memory (MB).

    Raises:
        FileNotFoundError: The study has left no such files.
    """
    paths = sorted(folder.rglob("*.tsv"))
    if not paths:
        raise FileNotFoundError(f"{folder}: no benchmark files; run the study first")
    rows = [pd.read_csv(path, sep="\t")[list(TIMES)].rename(columns=TIMES).iloc[0] for path in paths]
    stages = [path.relative_to(folder).parts[0].removesuffix(".tsv") for path in paths]
    return pd.DataFrame(rows).assign(stage=stages).reset_index(drop=True)


def start_up_s(stage: str) -> float:
    """Return the processor time (s) of a process that imports a stage and ends."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", f"import swesbi.stages.{stage}"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime)


def by_stage(jobs: pd.DataFrame) -> pd.DataFrame:
    """Add up the jobs of each stage, most expensive first."""
    table = jobs.groupby("stage").agg(
        jobs=("cpu_s", "size"),
        cpu_s=("cpu_s", "sum"),
        wall_s=("wall_s", "sum"),
        memory_mb=("memory_mb", "max"),
    )
    start_up_s(str(table.index[0]))  # files into the cache
    table["start_up_s"] = [start_up_s(str(stage)) * jobs for stage, jobs in table["jobs"].items()]
    table["share"] = table["cpu_s"] / table["cpu_s"].sum()
    return table.sort_values("cpu_s", ascending=False)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw the processor time of each stage, start-up apart."""
    rest = table.iloc[SHOWN:].sum().rename(f"{max(0, len(table) - SHOWN)} others")
    shown = pd.concat([table.iloc[:SHOWN], rest.to_frame().T]).iloc[::-1]
    start = shown["start_up_s"].clip(upper=shown["cpu_s"]) / 60.0
    with style():
        figure = new_figure(6.3, 3.6)
        axes = figure.subplots()
        axes.barh(shown.index, shown["cpu_s"] / 60.0 - start, left=start, color="#0072B2", label="work")
        axes.barh(shown.index, start, color="#E69F00", label="start-up")
        axes.set_xlabel("processor time (min), all jobs of a stage")
        axes.legend(frameon=False)
        save_figure(figure, path)
        plt.close(figure)


def main() -> None:
    """Print the table, and write table and figure where they are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--table", type=Path, help="CSV to write")
    parser.add_argument("--figure", type=Path, help="PNG or PDF to write")
    options = parser.parse_args()
    table = by_stage(read_jobs(options.results / "benchmarks"))
    print(table.round({"cpu_s": 1, "wall_s": 1, "memory_mb": 0, "start_up_s": 1, "share": 3}).to_string())
    total, start, jobs = table["cpu_s"].sum(), table["start_up_s"].sum(), int(table["jobs"].sum())
    print(f"\n{jobs} jobs, {total / 60:.1f} min of processor time; start-up {start / total:.1%}")
    if options.table:
        table.round(3).to_csv(options.table, lineterminator="\n")
    if options.figure:
        draw(table, options.figure)


if __name__ == "__main__":
    main()
