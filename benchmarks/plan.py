r"""Whether trials of the size that `plan` names have the power that it promises.

    python benchmarks/plan.py --trials 200 --csv trials.csv
    python benchmarks/plan.py --design groups --trials 200 --csv trials.csv

Persons are without hearts: the logarithm of each parameter is measured at each visit with normal errors as
large as the widths of posteriors, so that everybody's posterior is known in closed form
(tests/helpers/plan_case.py). A bank of them is planned with, by the settings of `config.yaml`; then trials of
the size that is needed are drawn afresh, and each is analysed by the posterior of the change in groups, or of
the cohort, as a real one is. Printed: the power reached with its Monte Carlo interval, trials without an
effect that find one, and how often the 90 % interval holds the effect.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd
from scipy.stats import binomtest

HELPERS: Final = Path(__file__).parents[1] / "tests" / "helpers"
sys.path.insert(0, str(HELPERS))

import hierarchy_case as case  # noqa: E402
import plan_case  # noqa: E402
import ratio_case  # noqa: E402

from swesbi.config.models import Config  # noqa: E402
from swesbi.config.read import parse_config, read_merged  # noqa: E402
from swesbi.persons.cohort.cohort import Member  # noqa: E402
from swesbi.persons.cohort.infer import CohortResult, infer_population, of_ratios, of_theta  # noqa: E402
from swesbi.persons.planning.effect import log_factor  # noqa: E402
from swesbi.persons.planning.likelihoods import StudyAnalysis, likelihoods_of  # noqa: E402
from swesbi.persons.planning.power import PowerCurve, power_curve  # noqa: E402
from swesbi.persons.settings import GROUPS, PAIRED  # noqa: E402

OF_TRIALS: Final = 50_000
"""Seeds of trials begin here, those of the bank below."""


def shipped() -> Config:
    """Return `config.yaml`."""
    path = Path("config.yaml")
    return parse_config(read_merged(path), str(path))


def planned(config: Config, by: StudyAnalysis, design: str) -> PowerCurve:
    """Plan with a bank of persons, and print what is needed."""
    settings = config.plan.studies
    start = time.process_time()
    bank = plan_case.bank(config.plan.persons.number, design, 1, 1000)
    evaluated = time.process_time()
    found = likelihoods_of(bank, design, plan_case.EFFECT, by)
    rule = (config.plan.probability, config.plan.power)
    curve = power_curve(found, 3, settings, rule, config.seed)
    studies = 3 * settings.studies * len(settings.sizes)
    print(
        f"{design}, {plan_case.EFFECT.words}: {curve.needed} persons for a power of {config.plan.power:.0%}; "
        f"bank {evaluated - start:.0f} s, {1e3 * (time.process_time() - evaluated) / studies:.2f} ms a study"
    )
    return curve


def trial(design: str, persons: int, effect: float, by: StudyAnalysis, seed: int) -> CohortResult:
    """Draw a trial afresh, and infer it."""
    rng = np.random.default_rng(seed)
    if design == PAIRED:
        members = ratio_case.members_of(plan_case.log_ratios(persons, effect, rng), ("",) * persons, seed)
        quantity = of_ratios(case.THETA_PRIOR, by.changes.hyperprior)
        return infer_population(members, quantity, by.cohort, None, seed)
    draws = np.concatenate(
        [
            plan_case.level_draws(
                plan_case.log_levels(persons, shift, rng),
                rng.standard_normal((persons, 3)),
                by.cohort.draws,
                seed + number,
            )
            for number, shift in ((0, 0.0), (7, effect))
        ]
    )
    groups = ["treated" if number >= persons else "control" for number in range(2 * persons)]
    contexts = case.contexts(2 * persons, rng)
    members = [
        Member(context, "not contradicted", group, theta, theta[:3])
        for context, group, theta in zip(contexts, groups, draws, strict=True)
    ]
    quantity = of_theta(case.THETA_PRIOR, by.cohort.hyperprior, covariates=())
    return infer_population(members, quantity, by.cohort, None, seed)


def run(design: str, trials: int) -> pd.DataFrame:
    """Plan, then return two rows a trial: with the effect and without."""
    config = shipped()
    by = StudyAnalysis(case.THETA_PRIOR, config.cohort_posterior, config.change_groups)
    needed = planned(config, by, design).needed[0]
    if needed is None:
        raise SystemExit("the power asked for is not reached; nothing to simulate")
    column = plan_case.EFFECT.number + (0 if design == PAIRED else 6)
    rows = []
    for seed in range(1, trials + 1):
        for effect in (log_factor(plan_case.EFFECT), 0.0):
            inferred = trial(design, needed, effect, by, OF_TRIALS + 10 * seed)
            found = np.log(inferred.exact.phi[:, column])
            rows.append(
                {
                    "persons": needed,
                    "trial": seed,
                    "effect": effect,
                    "probability": (found < 0.0).mean(),
                    "level": (found < effect).mean(),
                    "median": np.median(found),
                    "least_effective": inferred.shrinkage.effective.min(),
                    "sampler": inferred.exact.sampler,
                }
            )
        print(f"trial {seed}", flush=True)
    return pd.DataFrame(rows)


def summary(table: pd.DataFrame, design: str, probability: float) -> None:
    """Print power, false positives and coverage of all trials."""
    for effect, part in table.groupby("effect"):
        found = int((part["probability"] > probability).sum())
        held = int(((part["level"] > 0.05) & (part["level"] < 0.95)).sum())
        low, high = binomtest(found, len(part)).proportion_ci()
        print(
            f"{design}, {np.expm1(effect):+.0%}, {len(part)} trials of {part['persons'].iloc[0]} persons: "
            f"found in {found / len(part):.1%} ({low:.1%} to {high:.1%}), interval holds the effect in "
            f"{held / len(part):.1%}"
        )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--design", choices=[PAIRED, GROUPS], default=PAIRED)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--csv", type=Path, help="table to write, two rows a trial")
    asked = parser.parse_args()
    table = run(asked.design, asked.trials)
    summary(table, asked.design, shipped().plan.probability)
    if asked.csv:
        table.to_csv(asked.csv, index=False)


if __name__ == "__main__":
    main()
