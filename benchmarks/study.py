"""Where the time of a study goes: processor time, wall time and memory by stage, and what starting up costs.

    python benchmarks/study.py
    python benchmarks/study.py --profile profiles/slurm
    python benchmarks/study.py --table docs/tables/study_cost.csv

Adds up what the jobs of a run say in their logs. Start-up is what each job took until its stage began:
interpreter, Snakemake's preamble, imports.
With a profile, what it asks of a cluster stands beside what the jobs took.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd
import yaml

from swesbi.study.job import MEMORY, PROCESSOR_TIME, START_UP, WALL_TIME

SAID = {
    "start_up_s": START_UP,
    "cpu_s": PROCESSOR_TIME,
    "wall_s": WALL_TIME,
    "memory_mb": MEMORY,
}
SNAKEMAKE_MB = 500  # its own two processes in a job of a cluster


def read_jobs(folder: Path) -> pd.DataFrame:
    """Return one row a job of a study: stage, wall, processor and start-up time (s), largest memory (MB)."""
    logs = sorted((folder / "logs").rglob("*.log"))
    rows = [
        {"stage": log.relative_to(folder / "logs").parts[0].removesuffix(".log")}
        | {column: logged(log, begins) for column, begins in SAID.items()}
        for log in logs
    ]
    if not rows:
        raise FileNotFoundError(f"{folder / 'logs'}: no log of a job; run the study first")
    return pd.DataFrame(rows)


def asked(jobs: pd.DataFrame, profile: Path) -> pd.DataFrame:
    """Return memory (MB) and time (minutes) of each stage's largest job beside what a profile asks for it.

    ``spare`` is what is asked over what was taken, with Snakemake's processes; below 1 jobs are killed.
    """
    content = yaml.safe_load((profile / "config.yaml").read_text(encoding="utf-8"))
    ruled = content.get("set-resources", {})
    table = jobs.groupby("stage").agg(memory_mb=("memory_mb", "max"), wall_s=("wall_s", "max"))
    for name in ("mem_mb", "runtime"):
        default = content["default-resources"].get(name, float("nan"))
        table[name] = [ruled.get(stage, {}).get(name, default) for stage in table.index]
    table["spare_memory"] = table["mem_mb"] / (table["memory_mb"] + SNAKEMAKE_MB)
    table["spare_time"] = 60.0 * table["runtime"] / table["wall_s"]
    return table.sort_values("spare_memory")


def logged(log: Path, name: str) -> float:
    """Return the number that a job's log gives under a name; NaN where it does not say."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    found = [line.removeprefix(name) for line in lines if line.startswith(name)]
    return float(found[0].split()[0]) if found else float("nan")


def by_stage(jobs: pd.DataFrame) -> pd.DataFrame:
    """Add up the jobs of each stage, most expensive first."""
    table = jobs.groupby("stage").agg(
        jobs=("cpu_s", "size"),
        cpu_s=("cpu_s", lambda times: times.sum(skipna=False)),
        wall_s=("wall_s", "sum"),
        memory_mb=("memory_mb", "max"),
        start_up_s=("start_up_s", lambda times: times.sum(skipna=False)),
    )
    table["share"] = table["cpu_s"] / table["cpu_s"].sum()
    table["start_up_share"] = table["start_up_s"] / table["cpu_s"].sum()
    return table.sort_values("cpu_s", ascending=False)


def main() -> None:
    """Print the table, and write it where that is asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--profile", type=Path, help="folder of a profile, to compare with what jobs took")
    parser.add_argument("--table", type=Path, help="CSV to write")
    options = parser.parse_args()
    jobs = read_jobs(options.results)
    if options.profile:
        print(asked(jobs, options.profile).round(2).to_string())
        return
    table = by_stage(jobs)
    digits = {"cpu_s": 1, "wall_s": 1, "memory_mb": 0, "start_up_s": 1, "share": 3}
    print(table.round(digits).to_string())
    total = table["cpu_s"].sum(skipna=False)
    start = table["start_up_s"].sum(skipna=False) / total
    print(f"\n{len(jobs)} jobs, {total / 60:.1f} min of processor time; start-up {start:.1%}")
    if options.table:
        shares = {"share": 6, "start_up_share": 6}
        table.round(dict.fromkeys(table.columns, 3) | shares).to_csv(options.table, lineterminator="\n")


if __name__ == "__main__":
    main()
