"""What a study over a population costs for cohorts of any size, and how that grows.

    python benchmarks/scaling.py /tmp/scaling
    python benchmarks/scaling.py /tmp/scaling --sizes 6 60 600 --table scaling.csv --figure scaling.png

Cohorts are generated once into the folder, the smaller ones as the first subjects of the largest; each is
then run from nothing by Snakemake, with the network, its calibration and its nulls in the sizes of the smoke
study, so that what remains is what a subject costs. A size that has been measured in the folder is not run
again; `--dag` measures the planning of the study alone.
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
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import yaml
from generated import generate, write
from study import read_jobs

from swesbi.config.read import overlay, parse_config, read_yaml
from swesbi.show.figures.style import new_figure, save_figure, style

ROOT: Final = Path(__file__).parents[1]
FIRST: Final = 50  # number of the first generated subject that nothing was fitted to
FAR: Final = 100_000
OF_SUBJECTS: Final = ("ingest", "ingest_batch", "noise", "population_answers", "population_cohort")
COSTS: Final = {
    "dag_cpu_s": "processor time (s), planning",
    "cpu_s": "processor time (s), all jobs",
    "subjects_cpu_s": "processor time (s), jobs on subjects",
    "wall_s": "wall time (s)",
    "job_memory_mb": "memory (MB), largest job",
    "snakemake_memory_mb": "memory (MB), Snakemake",
}
TITLE: Final = "Cost of a cohort of generated subjects; dotted: proportional to the subjects"
POLL_S: Final = 0.5


@dataclass(frozen=True)
class Cost:
    """What one cohort cost; without a run, only planning."""

    subjects: int
    dag_s: float
    dag_cpu_s: float
    jobs: int
    wall_s: float
    cpu_s: float
    subjects_cpu_s: float
    largest_job: str
    job_memory_mb: float
    snakemake_memory_mb: float


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
        config = parse_config(read_yaml(ROOT / "config.yaml"), "config.yaml")
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


def measure(folder: Path, size: int, cores: int, *, plan_only: bool) -> Cost:
    """Plan and run the study over one cohort from nothing."""
    results, changes = folder / f"results-{size}", folder / f"changes-{size}.yaml"
    shutil.rmtree(results, ignore_errors=True)
    smoke = read_yaml(ROOT / "tests" / "smoke.yaml")
    own = {"cohort": str(folder / f"cohort-{size}"), "results": str(results), "run": ["amortised"]}
    own |= {"subjects": "all", "cohort_title": "generated subjects"}
    changes.write_text(yaml.safe_dump(overlay(smoke, own)), encoding="utf-8")
    command = [sys.executable, "-m", "snakemake", "--configfile", str(changes), "--cores", str(cores)]
    plan = run([*command, "--dry-run", "--quiet", "rules"])
    jobs = int(re.findall(r"^total\s+(\d+)", plan.output, re.MULTILINE)[0])
    nothing = float("nan")
    if plan_only:
        return Cost(
            size, plan.wall_s, plan.cpu_s, jobs, nothing, nothing, nothing, "", nothing, plan.memory_mb
        )
    done = run([*command, "--nolock"])
    found = read_jobs(results)
    largest = found.loc[found["memory_mb"].idxmax()]
    return Cost(
        subjects=size,
        dag_s=plan.wall_s,
        dag_cpu_s=plan.cpu_s,
        jobs=jobs,
        wall_s=done.wall_s,
        cpu_s=done.cpu_s,
        subjects_cpu_s=float(found.loc[found["stage"].isin(OF_SUBJECTS), "cpu_s"].sum()),
        largest_job=str(largest["stage"]),
        job_memory_mb=float(largest["memory_mb"]),
        snakemake_memory_mb=done.memory_mb,
    )


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


def growth(table: pd.DataFrame, column: str) -> float:
    """Return the exponent of a cost's growth: the slope of its logarithm over that of the subjects."""
    known = table.dropna(subset=[column])
    if len(known) < 2:
        return float("nan")
    return float(np.polyfit(np.log(known["subjects"]), np.log(known[column]), 1)[0])


def projected(table: pd.DataFrame, column: str) -> float:
    """Return a cost for ``FAR`` subjects: a straight line through the two largest cohorts."""
    known = table.dropna(subset=[column]).sort_values("subjects").iloc[-2:]
    if len(known) < 2:
        return float("nan")
    slope, start = np.polyfit(known["subjects"], known[column], 1)
    return float(start + slope * FAR)


def summarise(table: pd.DataFrame) -> pd.DataFrame:
    """Add to the measured costs their growth, over all cohorts and the two largest, and their projection."""
    grown = {"kind": "exponent"} | {name: growth(table, name) for name in COSTS}
    pair = table.nlargest(2, "subjects")
    last = {"kind": "exponent_largest"} | {name: growth(pair, name) for name in COSTS}
    far = {"kind": "projected", "subjects": FAR} | {name: projected(table, name) for name in COSTS}
    return pd.concat([table.assign(kind="measured"), pd.DataFrame([grown, last, far])], ignore_index=True)


def draw(table: pd.DataFrame, path: Path) -> None:
    """Draw every cost over the number of subjects, with its exponent, and a line of slope one."""
    with style():
        figure = new_figure(7.2, 4.0)
        for axes, (column, label) in zip(figure.subplots(2, 3).flat, COSTS.items(), strict=True):
            known = table.dropna(subset=[column])
            axes.loglog(known["subjects"], known[column], "o-", color="#0072B2")
            if len(known):
                scale = known[column].iloc[-1] / known["subjects"].iloc[-1]
                axes.loglog(known["subjects"], scale * known["subjects"], ":", color="#8C8C8C")
            last = growth(table.nlargest(2, "subjects"), column)
            axes.set_title(f"{label}\nexponent {growth(table, column):.2f}; two largest {last:.2f}")
            axes.set_xlabel("subjects")
        figure.suptitle(TITLE, fontsize=7.5)
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
    parser.add_argument("--dag", action="store_true", help="plan the studies, do not run them")
    parser.add_argument("--table", type=Path, help="CSV to write")
    parser.add_argument("--figure", type=Path, help="PNG or PDF to write")
    options = parser.parse_args()
    folder = options.folder.resolve()
    make_cohorts(folder, options.sizes, options.cores)
    costs = [_cost(folder, size, options.cores, plan_only=options.dag) for size in sorted(options.sizes)]
    table = pd.DataFrame(costs)
    summary = summarise(table)
    print(summary.round(2).to_string())
    print(
        f"\nprojection to {FAR} subjects: a straight line through the two largest cohorts, on this machine "
        f"and these {options.cores} cores; as many jobs, each serving more subjects, on such a file system"
    )
    if options.table:
        summary.round(3).to_csv(options.table, index=False, lineterminator="\n")
    if options.figure:
        draw(table, options.figure)


def _cost(folder: Path, size: int, cores: int, *, plan_only: bool) -> dict[str, object]:
    """Return the cost of a size, as measured before where it was."""
    kept = folder / f"cost-{size}.yaml"
    if not kept.exists() or plan_only:
        found = asdict(measure(folder, size, cores, plan_only=plan_only))
        if plan_only:
            return found
        kept.write_text(yaml.safe_dump(found), encoding="utf-8")
    found = yaml.safe_load(kept.read_text(encoding="utf-8"))
    return dict(found)


if __name__ == "__main__":
    main()
