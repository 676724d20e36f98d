"""What a study over a population costs for cohorts of any size, stage by stage, and how that grows.

    python benchmarks/scaling.py FOLDER
    python benchmarks/scaling.py FOLDER --sizes 6 60 600 --table docs/tables/scaling.csv

Subjects are generated with cuff pressures, once into the folder; smaller cohorts are the first of the
largest. Each cohort is run from nothing by Snakemake with the network of a finished study, so that what
remains is what subjects cost. What was measured in the folder is not run again.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import yaml
from generated import generate, write
from study import read_jobs

from swesbi.config.read import parse_config, read_merged
from swesbi.report.figures.style import new_figure, save_figure, style

ROOT: Final = Path(__file__).parents[1]
FIRST: Final = 50  # number of the first generated subject that nothing was fitted to
PLANNING: Final = "planning"
WHOLE: Final = "whole run"
TARGETS: Final = ("amortised/cohort.csv", "amortised/cohort_posterior.csv", "tables/pressures.csv")
SHOWN: Final = 8
POLL_S: Final = 0.5


@dataclass(frozen=True)
class Run:
    """One process and those it started."""

    output: str
    wall_s: float
    cpu_s: float
    memory_mb: float


def make_cohorts(folder: Path, sizes: list[int], workers: int) -> None:
    """Generate the largest cohort where it is not there; its first subjects make the smaller ones."""
    largest = folder / f"cohort-{max(sizes)}"
    if not largest.exists():
        config = parse_config(read_merged(ROOT / "config.yaml"), "config.yaml")
        parts = np.array_split(np.arange(FIRST, FIRST + max(sizes)), 8 * workers)
        with ProcessPoolExecutor(workers) as pool:
            numbers = [part.tolist() for part in parts if len(part)]
            made = [one for part in pool.map(generate, [config] * len(numbers), numbers) for one in part]
        write(largest, made, config)
    for size in sizes:
        if not (folder / f"cohort-{size}").exists():
            _copy_first(largest, folder / f"cohort-{size}", size)


def _copy_first(source: Path, target: Path, size: int) -> None:
    (target / "swe").mkdir(parents=True)
    shutil.copy(source / "recording.yaml", target)
    for name in ("subjects.csv", "truth.csv"):
        table = pd.read_csv(source / name, dtype=str).iloc[:size]
        table.to_csv(target / name, index=False, lineterminator="\n")
    for subject in table["subject"]:
        shutil.copy(source / "swe" / f"{subject}.csv", target / "swe")


def measure(folder: Path, size: int, cores: int, networks: Path) -> pd.DataFrame:
    """Plan and run the study over one cohort from nothing; a row a stage, planning and the whole too."""
    results, changes = folder / f"results-{size}", folder / f"changes-{size}.yaml"
    shutil.rmtree(results, ignore_errors=True)
    own = {"cohort": str(folder / f"cohort-{size}"), "results": str(results), "networks": str(networks)}
    own |= {"subjects": "all", "cohort_title": "generated subjects", "run": ["amortised"]}
    changes.write_text(yaml.safe_dump(own), encoding="utf-8")
    command = [sys.executable, "-m", "snakemake", "--configfile", str(changes), "--cores", str(cores)]
    targets = ["--", *(str(results / name) for name in TARGETS)]
    plan = run([*command, "--dry-run", "--quiet", "rules", *targets])
    done = run([*command, "--nolock", *targets])
    jobs = read_jobs(results)
    stages = jobs.groupby("stage").agg(
        jobs=("cpu_s", "size"),
        cpu_s=("cpu_s", "sum"),
        wall_s=("wall_s", "sum"),
        memory_mb=("memory_mb", "max"),
    )
    stages.loc[PLANNING] = [1, plan.cpu_s, plan.wall_s, plan.memory_mb]
    stages.loc[WHOLE] = [len(jobs), done.cpu_s, done.wall_s, done.memory_mb]
    return stages.reset_index().assign(subjects=size)


def run(command: list[str]) -> Run:
    """Run a command; its memory is its own peak, its processor time that of all that it started.

    Raises:
        RuntimeError: The command failed.
    """
    start, peaks = time.perf_counter(), [0.0]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        watch = threading.Thread(target=_watch, args=(process.pid, peaks), daemon=True)
        watch.start()
        output = process.stdout.read() if process.stdout else ""
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} failed:\n{output[-4000:]}")
    return Run(output, time.perf_counter() - start, used.ru_utime + used.ru_stime, peaks[0])


def _watch(process: int, peaks: list[float]) -> None:
    """Follow the peak memory (MB) of a process, without those that it starts, until it ends."""
    status = Path(f"/proc/{process}/status")
    while True:
        try:
            found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text(encoding="utf-8"))
        except OSError:
            return
        if found is None:
            return
        peaks[0] = float(found[1]) / 1024.0
        time.sleep(POLL_S)


def growth(table: pd.DataFrame) -> pd.Series:
    """Return by stage the exponent of its growth between the two largest cohorts."""
    costs = table.pivot(index="stage", columns="subjects", values="cpu_s")
    if costs.shape[1] < 2:
        return pd.Series(np.nan, index=costs.index)
    few, many = costs.columns[-2:]
    return np.log(costs[many] / costs[few]) / np.log(many / few)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw the processor time of the dearest stages over the number of subjects, and a line of slope one."""
    costs = table.pivot(index="subjects", columns="stage", values="cpu_s")
    exponents = growth(table)
    with style():
        figure = new_figure(6.3, 3.6)
        axes = figure.subplots()
        for stage in costs.iloc[-1].nlargest(SHOWN).index:
            axes.loglog(costs.index, costs[stage], "o-", label=f"{stage}, exponent {exponents[stage]:.2f}")
        largest = costs[WHOLE].iloc[-1] / costs.index[-1]
        axes.loglog(costs.index, largest * costs.index, ":", color="#8C8C8C", label="proportional")
        axes.set(xlabel="subjects", ylabel="processor time (s)")
        figure.legend(frameon=False, loc="outside right")
        save_figure(figure, path)
        plt.close(figure)


def main() -> None:
    """Measure, print, and write table and figure where they are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="of cohorts and results; kept between calls")
    parser.add_argument("--sizes", type=int, nargs="+", default=[6, 60], help="default: 6 60")
    parser.add_argument("--cores", type=int, default=2)
    parser.add_argument(
        "--networks", type=Path, default=ROOT / "results", help="results of a study that has finished"
    )
    parser.add_argument("--table", type=Path, help="CSV to write")
    parser.add_argument("--figure", type=Path, help="PNG or PDF to write")
    options = parser.parse_args()
    folder = options.folder.resolve()
    make_cohorts(folder, options.sizes, options.cores)
    found = [_cost(folder, size, options.cores, options.networks.resolve()) for size in sorted(options.sizes)]
    table = pd.concat(found, ignore_index=True)
    shown = table.pivot(index="stage", columns="subjects", values="cpu_s").assign(exponent=growth(table))
    print(shown.sort_values(max(options.sizes), ascending=False).round(2).to_string())
    print(table[table["stage"] == WHOLE].to_string(index=False))
    if options.table:
        table.round(2).to_csv(options.table, index=False, lineterminator="\n")
    if options.figure:
        draw(table, options.figure)


def _cost(folder: Path, size: int, cores: int, networks: Path) -> pd.DataFrame:
    """Return the costs of a size, as measured before where they were."""
    kept = folder / f"cost-{size}.csv"
    if not kept.exists():
        measure(folder, size, cores, networks).to_csv(kept, index=False)
    return pd.read_csv(kept)


if __name__ == "__main__":
    main()
