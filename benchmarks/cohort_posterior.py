r"""Whether the posterior of a cohort is right, what it is worth, and what it costs.

    python benchmarks/cohort_posterior.py calibration --cohorts 200 --csv calibration.csv
    python benchmarks/cohort_posterior.py joint
    python benchmarks/cohort_posterior.py scaling --subjects 75 150 300 600

Cohorts are made without hearts: hyperparameters are drawn from the shipped hyperpriors, persons from that
population, and the logarithm of each parameter of each is measured with normal errors as large as the widths
of the volunteers' posteriors. The posterior of each person alone is then known in closed form, so everything
behind it is tested: recycled draws, outliers, truncation, weights, draws anew. Settings are those of
`config.yaml`.

calibration: simulation-based calibration (Talts et al. 2018, arXiv:1804.06788). A row a hyperparameter: how
many of the credible intervals contain the true value, with the p-value of the ranks' uniformity; below, the
squared error of log theta by medians alone and within the population. One cohort takes seconds; `--first`
goes on with a file that was begun.
joint: hyperparameters and parameters of six persons by recycling, and by MCMC over all of them together; a
classifier tells the two apart (0.5: it cannot).
scaling: seconds and memory by number of persons, a process each.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chisquare

HELPERS: Final = Path(__file__).parents[1] / "tests" / "helpers"
sys.path.insert(0, str(HELPERS))

import hierarchy_case as case  # noqa: E402

from swesbi.config.read import parse_config, read_merged  # noqa: E402
from swesbi.parameters import THETA_NAMES  # noqa: E402
from swesbi.persons.cohort.cohort import Design, Member, design_of, weighted_quantiles  # noqa: E402
from swesbi.persons.cohort.hyperprior import Hyperprior, hyperprior_of  # noqa: E402
from swesbi.persons.cohort.infer import CohortResult, infer_cohort  # noqa: E402
from swesbi.persons.cohort.settings import HierarchySettings  # noqa: E402
from swesbi.prior import PriorSettings, draw_prior  # noqa: E402

FloatArray = NDArray[np.float64]
PERSONS: Final = 20
DRAWS: Final = 5000
RANK_BINS: Final = 10
LEVEL: Final = "level"
"""A row of the file says where a true hyperparameter lies in its draws; else the errors of a person."""
STATUSES: Final = ("not contradicted",) * 17 + ("doubtful",) * 2 + ("contradicted",)


def shipped() -> HierarchySettings:
    """Return the settings of `config.yaml`."""
    path = Path("config.yaml")
    return parse_config(read_merged(path), str(path)).cohort_posterior


@dataclass(frozen=True)
class Simulated:
    """A cohort with its truth: eta (k,), theta (d, 3)."""

    prior: Hyperprior
    design: Design
    eta: FloatArray
    theta: FloatArray
    measured: case.Measured


def simulate(count: int, seed: int, settings: HierarchySettings) -> tuple[Simulated, list[Member], list[str]]:
    """Draw a cohort of two groups from the hyperprior."""
    rng = np.random.default_rng(seed)
    contexts = case.contexts(count, rng)
    statuses = [STATUSES[number % len(STATUSES)] for number in range(count)]
    groups = ["ab"[(number // 2) % 2] for number in range(count)]
    none = np.empty((0, 3))
    blank = [
        Member(context, "not contradicted", group, none, none)
        for context, group in zip(contexts, groups, strict=True)
    ]
    design = design_of(blank)
    prior = hyperprior_of(design, case.THETA_PRIOR, settings.hyperprior)
    eta = draw_prior(prior, 1, rng)[0]
    outlier = np.array([settings.outliers.of(status) for status in statuses])
    theta, measured = case.draw_members(eta, design, outlier, rng)
    members = case.members_of(measured, contexts, statuses, groups, DRAWS, settings.draws)
    return Simulated(prior, design, eta, theta, measured), members, statuses


def infer(
    simulated: Simulated, members: list[Member], settings: HierarchySettings, seed: int
) -> CohortResult:
    """Infer a simulated cohort, drawing anew in closed form."""

    def redraw(subject: str, prior: PriorSettings, stream: int) -> FloatArray:
        return simulated.measured.posterior(int(subject[1:]), prior, settings.draws, stream)

    return infer_cohort(members, case.THETA_PRIOR, settings, redraw, seed)


def calibration(cohorts: int, first: int, csv: Path) -> None:
    """Write levels and errors of so many cohorts behind those that are in the file already."""
    settings = shipped()
    for seed in range(first, first + cohorts):
        start = time.process_time()
        simulated, members, statuses = simulate(PERSONS, seed, settings)
        inferred = infer(simulated, members, settings, seed)
        level = (inferred.exact.phi < simulated.eta).mean(axis=0)
        rows = [
            {"cohort": seed, "what": LEVEL, "name": name, "alone": np.nan, "within": each}
            for name, each in zip(simulated.prior.names, level, strict=True)
        ]
        rows += errors_of(seed, simulated, members, inferred, statuses)
        pd.DataFrame(rows).to_csv(csv, mode="a", header=not csv.exists(), index=False)
        print(
            f"cohort {seed}: {inferred.exact.sampler}, k-hat {inferred.exact.k_hat:.2f}, efficiency "
            f"{inferred.exact.efficiency:.2f}, drawn anew {sum(map(bool, inferred.refreshed))}, "
            f"{time.process_time() - start:.1f} s",
            flush=True,
        )


def errors_of(
    seed: int, simulated: Simulated, members: list[Member], inferred: CohortResult, statuses: list[str]
) -> list[dict[str, object]]:
    """Return the error of each person's log theta, alone and within the population."""
    half = np.array([0.5])
    rows: list[dict[str, object]] = []
    for d, member in enumerate(members):
        draws, weight = inferred.model.recycled[d], inferred.shrinkage.weights[d]
        within = weighted_quantiles(draws.theta, weight, half)[0]
        for j, name in enumerate(THETA_NAMES):
            truth = np.log(simulated.theta[d, j])
            rows.append(
                {
                    "cohort": seed,
                    "what": statuses[d],
                    "name": name,
                    "alone": np.log(member.alone[1, j]) - truth,
                    "within": np.log(within[j]) - truth,
                }
            )
    return rows


def summary(table: pd.DataFrame) -> pd.DataFrame:
    """Return coverage of the 90 % intervals and p-value of the ranks of each hyperparameter."""
    rows = []
    for name, part in table[table["what"] == LEVEL].groupby("name", sort=False):
        level = part["within"].to_numpy()
        counts = np.histogram(level, bins=np.linspace(0.0, 1.0, RANK_BINS + 1))[0]
        covered = ((level > 0.05) & (level < 0.95)).mean()
        p_value = float(chisquare(counts).pvalue)
        rows.append({"hyperparameter": name, "coverage_90": covered, "rank_p": p_value, "n": len(level)})
    return pd.DataFrame(rows)


def gained(table: pd.DataFrame) -> pd.DataFrame:
    """Return mean squared errors of log theta alone and within the population, by parameter."""
    errors = table[table["what"] != LEVEL]
    squared = errors.assign(alone=errors["alone"] ** 2, within=errors["within"] ** 2)
    means = squared.groupby("name", sort=False)[["alone", "within"]].mean()
    return means.assign(lower_by=1.0 - means["within"] / means["alone"])


def scaling(subjects: list[int]) -> None:
    """Print seconds of one core and memory, a process for each number of persons."""
    for count in subjects:
        command = [sys.executable, __file__, "one", "--subjects", str(count)]
        print(subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip(), flush=True)


def one(count: int) -> None:
    """Infer one cohort and print what it cost."""
    settings = shipped()
    simulated, members, _ = simulate(count, 1, settings)
    start, wall = time.process_time(), time.perf_counter()
    inferred = infer(simulated, members, settings, 1)
    spent, wall = time.process_time() - start, time.perf_counter() - wall
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(
        f"{count} persons: {spent:.1f} s of one core, {wall:.1f} s by the clock, {memory:.2f} GiB; by "
        f"{inferred.exact.sampler}, k-hat {inferred.exact.k_hat:.2f}, efficiency "
        f"{inferred.exact.efficiency:.2f}, drawn anew {sum(map(bool, inferred.refreshed))}, "
        f"least effective {inferred.shrinkage.effective.min():.0f}"
    )


def joint(seed: int) -> None:
    """Print how well a classifier tells recycling from MCMC over everything."""
    from together_case import joint_accuracy

    accuracy, distinct = joint_accuracy(shipped(), seed)
    print(f"six persons: C2ST {accuracy:.3f} by hyperparameters and parameters, {distinct} distinct draws")


def main() -> None:
    """Run one of the three."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=["calibration", "joint", "scaling", "one"])
    parser.add_argument("--cohorts", type=int, default=200)
    parser.add_argument("--first", type=int, default=1, help="seed of the first cohort")
    parser.add_argument("--subjects", type=int, nargs="+", default=[75, 150, 300, 600])
    parser.add_argument("--csv", type=Path, default=Path("calibration.csv"), help="rows are added to it")
    asked = parser.parse_args()
    if asked.what == "calibration":
        calibration(asked.cohorts, asked.first, asked.csv)
        table = pd.read_csv(asked.csv)
        print(summary(table).to_string(index=False), gained(table).to_string(), sep="\n")
    elif asked.what == "scaling":
        scaling(asked.subjects)
    elif asked.what == "one":
        one(asked.subjects[0])
    else:
        joint(asked.first)


if __name__ == "__main__":
    main()
