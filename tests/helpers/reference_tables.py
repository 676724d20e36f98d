"""The numbers of a finished small study, as tables that are stored and compared.

A table belongs to one experiment, ``cohort.csv`` to what is no experiment's, and has one number a row:
subject (empty where it is the whole cohort's), quantity, value, Monte Carlo standard error (empty where there
is none). ``make reference`` renews what is stored by

    python tests/helpers/reference_tables.py results-smoke tests/reference/small_study

Tolerances follow from what can differ between machines. The last digits of sums and of compiled code do, and
nothing else does before a network is trained. Training amplifies them, and draws from a network move with it.
A sampler that adapts may take another way from there. Its numbers are compared in units of their Monte Carlo
errors, and what is made of its draws and has no such error is not compared.
``test_mutations.py`` shows what a rounding error, a wrong sign or a lost term does.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.stats import norm

from swesbi.parameters import OF_INTEREST, PHI_NAMES
from swesbi.posterior.result import ExactPosterior

SMALL_STUDY: Final = Path(__file__).parents[1] / "reference" / "small_study"
COHORT: Final = "cohort"
KEYS: Final = ["experiment", "subject", "quantity"]
DIGITS: Final = 9  # stored; well beyond the closest tolerance
SHOWN_SIMULATIONS: Final = 3
SUBJECTS: Final = ("A", "F", "G")
OF_PAPER: Final = ("A", "F")
KNOWN: Final = ("A",)
"""Whom both networks know. CMA-ES seeks the mode of others, and a rounding error sends it elsewhere."""
FEATURES: Final = ("paper", "scalar_only")
SPEEDS: Final = ("calibrated", "amortised")
EVERY: Final = (*FEATURES, *SPEEDS)

MONTE_CARLO_ERRORS: Final = 6.0  # by which a sampler's number may move: four of the difference of two


class Found(NamedTuple):
    """A number or word of an artefact: its name there, and its Monte Carlo standard error, if it has one."""

    name: str
    value: object
    error: float = 0.0


Numbers = Iterator[Found]


class Tolerance(NamedTuple):
    """A number agrees within ``absolute + relative * |stored|`` and ``MONTE_CARLO_ERRORS`` of its errors."""

    relative: float
    absolute: float = 1e-9


ROUNDED: Final = Tolerance(1e-6)  # sums and compiled code in another order
SEARCHED: Final = Tolerance(1e-4, 1e-6)  # where an optimiser stops
TRAINED: Final = Tolerance(1e-3, 1e-4)  # draws from a trained network, two hundred times what was measured
LOSS: Final = Tolerance(5e-3)  # of the last of few epochs, three times what two kinds of processors differ by
COUNTED: Final = Tolerance(0.0, 2.0)  # two draws of thousands on the other side of a bound
SHARE: Final = Tolerance(0.0, 0.05)  # one recording of 24, a few draws of 100 on the other side of a limit


class Source(NamedTuple):
    """What ``read`` takes from one artefact of experiments or the cohort, and whose.

    Names of numbers are looked up in ``tolerances`` by what they begin with; the longest that fits holds.
    """

    experiments: tuple[str, ...]
    path: str
    read: Callable[[Path], Numbers]
    tolerances: dict[str, Tolerance]
    subjects: tuple[str, ...] = SUBJECTS

    @property
    def name(self) -> str:
        """What names of its numbers begin with: its file's, or its folder's where a subject names it."""
        path = Path(self.path)
        return path.parts[0] if path.parts[0] in {"cmaes", "simulations"} else path.stem

    def numbers(self, results: Path) -> Iterator[Number]:
        """Yield its numbers of every experiment and subject."""
        for experiment in self.experiments:
            for subject in self._subjects(experiment):
                path = results / self.path.format(experiment=experiment, subject=subject)
                for name, value, error in self.read(path):
                    quantity, told = f"{self.name}/{name}", _text(error) if error else ""
                    tolerance = self.tolerances[max(filter(name.startswith, self.tolerances), key=len)]
                    yield Number(experiment, subject, quantity, _text(value), told, tolerance)

    def _subjects(self, experiment: str) -> tuple[str, ...]:
        """Return the subjects that have this artefact; one of the experiment or the cohort has no subject."""
        if "{subject}" not in self.path:
            return ("",)
        of_paper = experiment in FEATURES or self.path.startswith("simulations/paper/")
        return tuple(name for name in self.subjects if name in OF_PAPER or not of_paper)


class Number(NamedTuple):
    """One row: whose it is, what it is, value and error as text, and how far it may move."""

    experiment: str
    subject: str
    quantity: str
    value: str
    error: str
    tolerance: Tolerance


def _text(value: object) -> str:
    """Return a value as it is stored: words as they are, numbers rounded to ``DIGITS`` digits."""
    if isinstance(value, bool | np.bool_):
        return str(bool(value))
    if isinstance(value, int | float | np.number):
        return f"{value:.{DIGITS}g}"
    return "" if value is None else str(value)


def datasets(*names: str, group: str | None = None) -> Callable[[Path], Numbers]:
    """Return the reader of datasets of an artefact: one number an element, named by its labels."""

    def read(path: Path) -> Numbers:
        with xr.open_dataset(path, group=group, engine="h5netcdf") as content:
            for name in names:
                yield from _elements(f"{group}/{name}" if group else name, content[name])

    return read


def _elements(name: str, array: xr.DataArray) -> Numbers:
    """Yield the elements of a dataset; a dimension without coordinates counts from zero."""
    labels = [array.get_index(dim) for dim in array.dims]
    for index in np.ndindex(array.shape):
        inside = ",".join(_label(label[i]) for label, i in zip(labels, index, strict=True))
        yield Found(f"{name}[{inside}]" if inside else name, array.values[index])


def _label(value: object) -> str:
    """Return a label as part of a name, which the last digits of a phase must not change."""
    return f"{value:.6f}" if isinstance(value, float) else str(value)


def simulated(path: Path) -> Numbers:
    """Yield what the forward model gives at the first theta of a shard: volumes, peak and its time."""
    with xr.open_dataset(path, engine="h5netcdf") as content:
        for i in range(SHOWN_SIMULATIONS):
            one = content.isel(simulation=i)
            active, diastolic = one["active_stiffness_kpa"].values, float(one["end_diastolic_volume_ml"])
            yield from (Found(f"{name}[{i}]", value) for name, value, _ in _elements("theta", one["theta"]))
            yield Found(f"end_diastolic_volume_ml[{i}]", diastolic)
            yield Found(f"ejection_fraction[{i}]", 1.0 - float(one["end_systolic_volume_ml"]) / diastolic)
            yield Found(f"peak_kpa[{i}]", active.max())
            yield Found(f"time_to_peak_cycle[{i}]", content["cycle_phase"].values[active.argmax()])
            yield Found(f"mean_kpa[{i}]", active.mean())
            yield Found(f"beats[{i}]", int(one["beats"]))


def table(keys: list[str], columns: list[str]) -> Callable[[Path], Numbers]:
    """Return the reader of the columns of a CSV whose rows the keys name."""

    def read(path: Path) -> Numbers:
        content = pd.read_csv(path)
        for _, row in content.iterrows():
            inside = ",".join(str(row[key]) for key in keys)
            yield from (Found(f"{column}[{inside}]", row[column]) for column in columns)

    return read


def last_epoch(path: Path) -> Numbers:
    """Yield the losses of the last epoch of a training."""
    row = pd.read_csv(path).iloc[-1]
    yield from (Found(name, row[name]) for name in ("epoch", "training_loss", "validation_loss"))


def exact_draws(path: Path) -> Numbers:
    """Yield medians, interval ends and evidence of an exact posterior.

    The error of a quantile is that of a normal distribution, or half the range of the quantiles one standard
    error of its level to each side, whichever is larger: a long tail makes the first too small, draws that
    repeat the second.
    """
    posterior = ExactPosterior.read(path)
    for name, draws, number in zip(
        PHI_NAMES, posterior.phi[:, OF_INTEREST].T, posterior.effective_draws[OF_INTEREST], strict=True
    ):
        for end, level in ENDS.items():
            of_level = np.sqrt(level * (1.0 - level) / number)
            of_normal = of_level / norm.pdf(norm.ppf(level)) * draws.std()
            low, high = np.quantile(draws, np.clip([level - of_level, level + of_level], 0.0, 1.0))
            error = max(of_normal, (high - low) / 2.0)
            yield Found(f"{end}[{name}]", np.quantile(draws, level), error)
    yield Found("log_evidence", posterior.log_evidence, posterior.weighted.log_evidence_se)


def network_means(path: Path) -> Numbers:
    """Yield the means of the draws of a network on speeds, recording by recording."""
    with xr.open_dataset(path, engine="h5netcdf") as root:
        draws = json.loads(root.attrs["settings"])["recordings"]["network_draws"]
    with xr.open_dataset(path, group="model_noise", engine="h5netcdf") as own:
        errors = own["proposal_sd"].to_numpy().ravel() / np.sqrt(draws)
        for (name, mean, _), error in zip(
            _elements("proposal_mean", own["proposal_mean"]), errors, strict=True
        ):
            yield Found(name, mean, float(error))


def verdict(*names: str) -> Callable[[Path], Numbers]:
    """Return the reader of what a verdict states."""

    def read(path: Path) -> Numbers:
        content = json.loads(path.read_text(encoding="utf-8"))
        for name in names:
            value = content.get(name)
            if isinstance(value, dict):
                yield from (Found(f"{name}[{key}]", one) for key, one in value.items())
            else:
                yield Found(name, value)

    return read


def tests_without_draws(path: Path) -> Numbers:
    """Yield what a verdict says that takes no draws of the exact posterior."""
    content = json.loads(path.read_text(encoding="utf-8"))
    yield Found("in_prior_draws", content.get("in_prior_draws"))
    for test in content.get("tests", ()):
        if test["name"] in WITHOUT_DRAWS:
            asked = ("statistic", "p_value", "flagged")
            yield from (Found(f"{key}[{test['name']}]", test[key]) for key in asked)


RECOVERY: Final = table(["parameter", "nominal"], ["coverage", "n", "bias", "contraction"])
RECOVERED: Final = {"": TRAINED, "coverage": SHARE, "n": COUNTED}
SCORES: Final = (
    "rmse_kpa", "nrmse", "r2", "post_peak_rmse_kpa", "coverage", "phases_coverage", "failed",
    "coverage_noiseless", "coverage_observed", "coverage_envelope",
)  # fmt: skip
CHECKED: Final = ("feature_median", "feature_low", "feature_high")
ENDS: Final = {"low": 0.05, "median": 0.5, "high": 0.95}
WITHOUT_DRAWS: Final = {"noise", "context_leave_one_out", "context_ranges"}
COVERED: Final = {"": TRAINED, "posterior/phases_coverage": SHARE, "posterior/coverage": SHARE}
SUBJECT: Final = "{experiment}/subjects/{subject}"
OF_FEATURES: Final = ("status", "unfiltered_median", "max_abs_z", "worst_component")
VERDICT: Final = f"{SUBJECT}/verdict.json"
PREDICTIVE: Final = f"{SUBJECT}/predictive.h5"
RECORDING: Final = datasets(
    "stiffness_kpa", "stiffness_se_kpa", "repeat_noise_fraction", "sample_noise_fraction"
)
PASSIVE: Final = datasets("scale_kpa", "late_diastolic_observed_kpa", "late_diastolic_active_kpa")
NOISE: Final = datasets("fraction", "standard_error", "low", "high", "homogeneity_p")
CMAES: Final = datasets("theta", "loss", "rmse_kpa", "run_loss")
POSTERIOR: Final = datasets("median", "interval", "correlation")

SOURCES: Final = (
    Source((COHORT,), "cohort/{subject}/observation.h5", RECORDING, {"": ROUNDED}),
    Source((COHORT,), "cohort/{subject}/passive.h5", PASSIVE, {"": ROUNDED}),
    Source((COHORT,), "cohort/noise.h5", NOISE, {"": SEARCHED}),
    Source((COHORT,), "simulations/paper/{subject}/shard-0.h5", simulated, {"": ROUNDED}),
    Source((COHORT,), "cmaes/{subject}.h5", CMAES, {"": SEARCHED}),
    Source(FEATURES, "{experiment}/pool.h5", datasets("mean", "scale", "observed"), {"": ROUNDED}),
    Source(EVERY, "{experiment}/training.csv", last_epoch, {"": LOSS}),
    Source(FEATURES, f"{SUBJECT}/posterior.h5", POSTERIOR, {"": TRAINED}),
    Source(SPEEDS, f"{SUBJECT}/posterior.h5", exact_draws, {"": TRAINED}, KNOWN),
    Source(SPEEDS, VERDICT, verdict("status"), {"": TRAINED}, KNOWN),
    # of speeds all but the status is told at one draw of a sampler
    Source(FEATURES, VERDICT, verdict(*OF_FEATURES), {"": TRAINED}),
    Source(EVERY, VERDICT, tests_without_draws, {"": TRAINED, "in_prior_draws": COUNTED, "p_value": SHARE}),
    Source(EVERY, PREDICTIVE, datasets(*SCORES, *CHECKED, group="prior"), {"": ROUNDED}),
    Source(FEATURES, PREDICTIVE, datasets(*SCORES, *CHECKED, group="posterior"), COVERED),
    Source(FEATURES, "{experiment}/recovery.csv", RECOVERY, RECOVERED),
    Source(FEATURES, "{experiment}/recovery_acquisition.csv", RECOVERY, RECOVERED),
    Source(("calibrated",), f"{SUBJECT}/calibration_recordings.h5", network_means, {"": TRAINED}),
)


def small_study(results: Path) -> pd.DataFrame:
    """Return every number of a finished small study, with the fields of ``Number`` as columns."""
    rows = [number for source in SOURCES for number in source.numbers(results)]
    return pd.DataFrame(rows, columns=list(Number._fields))


def stored(folder: Path) -> pd.DataFrame:
    """Read the stored tables; columns experiment, subject, quantity, value, error, all text."""
    tables = {path.stem: pd.read_csv(path, dtype=str, keep_default_na=False) for path in folder.glob("*.csv")}
    return pd.concat([content.assign(experiment=name) for name, content in sorted(tables.items())])


def store(numbers: pd.DataFrame, folder: Path) -> None:
    """Write the numbers of a finished small study, one table an experiment."""
    folder.mkdir(parents=True, exist_ok=True)
    for experiment, rows in numbers.groupby("experiment"):
        rows[["subject", "quantity", "value", "error"]].to_csv(folder / f"{experiment}.csv", index=False)


def differences(numbers: pd.DataFrame, folder: Path) -> pd.DataFrame:
    """Return the numbers of a finished small study that do not agree with the stored tables; none if all do.

    A row that one side lacks does not agree. Errors are those that are stored. Beside the keys, the columns
    are ``stored`` and ``found``, and ``excess``: the difference over what is allowed, infinite for words and
    where a side is missing or NaN.
    """
    both = numbers.merge(stored(folder), "outer", KEYS, suffixes=("", "_stored"))
    compared = (both[name] for name in ("value", "value_stored", "tolerance", "error_stored"))
    both["excess"] = [_excess(*row) for row in zip(*compared, strict=True)]
    apart = both[both["excess"] > 1.0].rename(columns={"value": "found", "value_stored": "stored"})
    return apart[[*KEYS, "stored", "found", "excess"]].reset_index(drop=True)


def _excess(found: object, stored: object, tolerance: object, error: object) -> float:
    """Return the difference over the tolerance; zero for equal texts, infinite where it has no size."""
    if found == stored:
        return 0.0
    if not isinstance(tolerance, Tolerance):  # found lacks the row
        return np.inf
    try:
        apart, size = abs(float(str(found)) - float(str(stored))), abs(float(str(stored)))
    except ValueError:
        return np.inf
    allowed = tolerance.absolute + tolerance.relative * size + MONTE_CARLO_ERRORS * float(str(error) or 0.0)
    excess = apart / allowed
    return excess if np.isfinite(excess) else np.inf


def main() -> None:
    """Store the tables of a finished small study."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    store(small_study(arguments.results), arguments.folder)


if __name__ == "__main__":
    main()
