"""Two samplers on the same recordings: coverage of every parameter, levels in pairs, draws by a classifier.

    git worktree add ../former 87e7ba3
    ln -s "$PWD/results" ../former/
    (cd ../former && PYTHONPATH=src python "$OLDPWD/benchmarks/samplers.py" infer former.npz)
    python benchmarks/samplers.py infer current.npz
    python benchmarks/samplers.py compare ../former/former.npz current.npz --table docs/tables/samplers.csv

`infer` makes fresh recordings of the population and infers each by the sampler of the checkout in whose
folder it runs: levels of the truth among a hundred effective draws, and of twenty recordings the draws of a
posterior as it is reported. Streams are those of all checkouts, so the recordings are the same.
"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import binomtest, ks_2samp, kstest

from swesbi.base.progress import Progress
from swesbi.checks.calibration.fresh import infer_fresh
from swesbi.checks.calibration.ranks import quantity_names
from swesbi.config.read import read_merged
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import flow_proposal
from swesbi.population.recordings import OWN, fresh_subject, record_fresh, recorded
from swesbi.prior import JointPriorSettings
from swesbi.report.csv import write_csv
from swesbi.study.stages.population import PopulationCalibrationStageSettings

try:  # the sampler of before, which threw the draws of earlier attempts away
    from swesbi.posterior.refine import refined_posterior as exact_posterior  # type: ignore
except ImportError:
    from swesbi.posterior.exact import exact_posterior

RECORDINGS, COMPARED, DRAWS, LEVEL = 500, 20, 2000, 0.9
SEED, STREAM = 7, "samplers"


def settings() -> PopulationCalibrationStageSettings:
    """Return the settings of the calibration over the population, of the folder's configuration."""
    study = load_study(read_merged(Path("config.yaml"), None), "config.yaml")
    plain = stage_settings(study, "population_calibration", experiment="amortised", part="0")
    return PopulationCalibrationStageSettings.from_plain(plain)


def infer(network: Path, out: Path, recordings: int) -> None:
    """Infer the recordings, and write levels, truths and draws."""
    given, flow = settings(), load_flow(network)[0]
    fresh = infer_fresh(range(recordings), OWN, flow, given.fresh, given.sizes, given.exact, SEED)
    draws, effective = [], []
    progress = Progress("posteriors", COMPARED, unit="recording")
    for number in range(COMPARED):
        subject = fresh_subject(number, given.fresh, SEED, STREAM)
        model = recorded(subject, record_fresh(subject, OWN, given.fresh, SEED, STREAM, OWN))
        proposal = flow_proposal(flow, model.recording)
        exact, _ = exact_posterior(model, proposal, given.exact, SEED, STREAM, number)
        draws.append(exact.phi[:DRAWS])
        effective.append(exact.effective_draws.min())
        progress.step()
    ranked = fresh.inferred.ranked
    np.savez(
        out,
        level=ranked.weighted.level,
        truth=ranked.truth,
        draws=np.stack(draws),
        effective=np.array(effective),
        by_mcmc=fresh.inferred.diagnostics.by_mcmc,
    )


def compare(former: Path, current: Path, prior: JointPriorSettings) -> pd.DataFrame:
    """Return a row a quantity: coverage by both, levels pair by pair; then a row of the classifier."""
    one, other = (np.load(path) for path in (former, current))
    if not np.array_equal(one["truth"], other["truth"], equal_nan=True):
        raise ValueError(f"{former} and {current} are not of the same recordings")
    rows = [
        _of_quantity(name, one["level"][:, column], other["level"][:, column])
        for column, name in enumerate(quantity_names(prior))
    ]
    told = c2st(one["draws"], other["draws"], prior)
    rows.append(
        {
            "quantity": f"c2st of {len(told)}, mean",
            "current": told.mean(),
            "current_low": told.mean() - 2.0 * told.std(ddof=1) / np.sqrt(len(told)),
            "current_high": told.mean() + 2.0 * told.std(ddof=1) / np.sqrt(len(told)),
            "former_effective_draws": one["effective"].min(),
            "current_effective_draws": other["effective"].min(),
        }
    )
    return pd.DataFrame(rows)


def _of_quantity(name: str, former: NDArray[np.float64], current: NDArray[np.float64]) -> dict[str, object]:
    covered = [np.abs(2.0 * level - 1.0) <= LEVEL for level in (former, current)]
    interval = binomtest(int(covered[1].sum()), len(current)).proportion_ci(0.95, method="exact")
    difference = current - former
    return {
        "quantity": name,
        "recordings": len(current),
        "former": covered[0].mean(),
        "current": covered[1].mean(),
        "current_low": interval.low,
        "current_high": interval.high,
        "mean_difference": difference.mean(),
        "mean_difference_se": difference.std(ddof=1) / np.sqrt(len(difference)),
        "rms_difference": np.sqrt(np.mean(difference**2)),
        "same_distribution_p": ks_2samp(former, current).pvalue,
        "uniform_p": kstest(current, "uniform").pvalue,
    }


def c2st(
    former: NDArray[np.float64], current: NDArray[np.float64], prior: JointPriorSettings
) -> NDArray[np.float64]:
    """Return the accuracy of a classifier of each pair of draws (n, draws, d); shape (n,)."""
    from swesbi.checks.calibration.local import classifier_accuracy

    pairs = enumerate(zip(former, current, strict=True))
    return np.array([classifier_accuracy(one, other, prior, number) for number, (one, other) in pairs])


def main() -> None:
    """Infer by the sampler of this checkout, or compare two."""
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    inferring = commands.add_parser("infer", help="levels and draws by the sampler of this checkout")
    inferring.add_argument("out", type=Path)
    inferring.add_argument("--network", type=Path, default=Path("results/amortised/flow.h5"))
    inferring.add_argument("--recordings", type=int, default=RECORDINGS)
    comparing = commands.add_parser("compare", help="two files of `infer`")
    comparing.add_argument("former", type=Path)
    comparing.add_argument("current", type=Path)
    comparing.add_argument("--table", type=Path, help="CSV to write")
    options = parser.parse_args()
    if options.command == "infer":
        infer(options.network, options.out, options.recordings)
        return
    table = compare(options.former, options.current, settings().fresh.model.prior)
    print(table.round(3).to_string(index=False))
    if options.table:
        write_csv(options.table, table)


if __name__ == "__main__":
    main()
