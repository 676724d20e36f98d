"""What the fast tests guard: which of them fail when one line of the package is wrong.

Each mutant is a fault of one line that a person could make. It is put into a private copy of the project,
where the tests of its package run; those that fail are its killers. ``tests/reference/mutants.csv`` keeps
them. Tests may change or go as long as every mutant that was killed is killed still, by whatever test:

    python tests/mutants.py                      # all of them, held against the stored table
    python tests/mutants.py --out FILE NAME...   # some of them, or of some packages, into a table

The mutations of ``tests/study/test_mutations.py`` are another thing: edits of a whole finished study, which
the stored tables of its results must notice. Here no study is run, and only tests are asked.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from typing import Final
from xml.etree import ElementTree

import pandas as pd

ROOT: Final = Path(__file__).resolve().parents[1]
STORED: Final = Path("tests/reference/mutants.csv")
SOURCE: Final = Path("src/swesbi")
STUDIES: Final = "studies/"
COLUMNS: Final = ("mutant", "package", "killed_by", "number")
SEPARATOR: Final = "; "
FAST: Final = "not slow and not exhaustive"
LONGEST_S: Final = 3600.0
"""Of a run without a mutant; one with a mutant may take ``SLOWER`` times as long and ``SPARE_S`` more."""
SLOWER: Final = 4.0
SPARE_S: Final = 120.0
TIMEOUT: Final = "timeout"
NOTHING_RUN: Final = "no test can be run"
TESTS: Final[Mapping[str, str]] = {
    "base": "posterior/test_prior posterior/test_prior_draws posterior/test_importance checks/test_recovery "
    "population/test_contexts study/test_seeds",
    "artefacts": "study/test_artefacts study/test_faults_artefacts",
    "persons/change": "persons/test_change persons/test_change_groups persons/test_joint_change "
    "persons/test_visits_joint",
    "persons/cohort": "persons/test_change_groups persons/test_cohort_calibration persons/test_cohort_design "
    "persons/test_cohort_posterior persons/test_redraw persons/test_population_likelihood "
    "persons/test_shrinkage",
    "persons/planning": "persons/test_planned_power persons/test_plan_effect persons/test_plan_arms",
    "checks": "checks/test_calibration checks/test_scores checks/test_information checks/test_power_scaling",
    "config": "config/test_config study/test_new_cohort",
    "heart": "heart/test_simulate heart/test_invariants heart/test_references heart/test_stressed_volume "
    "heart/test_options",
    "networks": "networks/test_flow networks/test_cells networks/test_pool",
    "studies/validation": "studies/validation/tests/test_passive_of_other_hearts",
    "virtual/trial": "virtual/test_virtual_trial",
    "recording": "recording/test_noise recording/test_folder_noise recording/test_sweeps "
    "recording/test_ingest recording/test_free recording/test_neighbours "
    "virtual/test_virtual_cohort",
    "report": "report/test_report_page report/test_report_exact",
    "study": "study/test_inspection persons/test_plan_effect study/test_code_hash",
    "verdict": "verdict/test_misfits verdict/test_nulls verdict/test_verdict",
}
"""Files of tests by package, where a package has no folder of tests, or one that takes minutes."""


@dataclass(frozen=True)
class Mutant:
    """A fault of one line.

    Attributes:
        name: What is wrong.
        file: Below ``src/swesbi``; of a side study, with its folder.
        old: Text that the file has once.
        new: What takes its place.
    """

    name: str
    file: str
    old: str
    new: str

    @property
    def place(self) -> Path:
        """The file in the project."""
        return Path(self.file) if self.file.startswith(STUDIES) else SOURCE / self.file

    @property
    def package(self) -> str:
        """The package of the file, or the part of it that `TESTS` names; "base" for modules in none."""
        parts = [str(folder) for folder in Path(self.file).parents[:-1]]
        return next((part for part in parts if part in TESTS), parts[-1] if parts else "base")

    @property
    def suite(self) -> tuple[str, ...]:
        """Files or folders of the tests."""
        files = TESTS.get(self.package, "").split()
        beside = "" if self.file.startswith(STUDIES) else "tests/"
        return tuple(f"{beside}{name}.py" for name in files) or (f"tests/{self.package}",)

    def edited(self, folder: Path) -> str:
        """Return the text of the file with the fault.

        Raises:
            ValueError: The project in ``folder`` does not have the old text once.
        """
        path = folder / self.place
        text = path.read_text(encoding="utf-8")
        if (places := text.count(self.old)) != 1:
            raise ValueError(f"{self.name}: {path} has {self.old!r} {places} times; write it anew")
        changed = text.replace(self.old, self.new)
        compile(changed, str(path), "exec")
        return changed

    @contextmanager
    def applied(self, folder: Path) -> Iterator[None]:
        """Have the project in ``folder`` wrong within the block."""
        path = folder / self.place
        right = path.read_text(encoding="utf-8")
        path.write_text(self.edited(folder), encoding="utf-8")
        try:
            yield
        finally:
            path.write_text(right, encoding="utf-8")


MUTANTS: Final = (
    Mutant("noise of a folder forgets what is expected", "recording/noise/folder.py",
           "return float(0.5 * distance @ distance", "return float(0.0 * distance @ distance"),
    Mutant("one recording stands for all of its folder", "recording/noise/folder.py",
           "return FolderNoise(NoiseComponents(*np.exp(found.x).tolist()), len(recordings))",
           "return FolderNoise(NoiseComponents(*np.exp(found.x).tolist()), 1)"),
    Mutant("the normal approximation forgets the prior", "posterior/laplace.py",
           "np.eye(len(u))])", "0.0 * np.eye(len(u))])"),
    Mutant("levels of an interval are one-sided", "draws.py",
           "[0.5 - 0.5 * mass, 0.5 + 0.5 * mass]", "[1.0 - mass, mass]"),
    Mutant("systematic resampling prefers the first draws", "draws.py",
           "(np.arange(draws) + rng.random()) / draws", "((np.arange(draws) + rng.random()) / draws) ** 1.2"),
    Mutant("Jacobian 1/theta lost in the prior's density", "prior.py",
           "** 2 - log_theta - of.log_norm", "** 2 - of.log_norm"),
    Mutant("texts in the name of a random stream do not count", "seeds.py", "digest()[:4]", "digest()[:0]"),
    Mutant("hash of the code leaves out what imports do", "study/code.py",
           "{*filter(None, found.values()), *effects}", "{*filter(None, found.values())}"),
    Mutant("artefact with other units is accepted", "artefacts/schema.py",
           'array.attrs.get("units") != expected.units', '"units" not in array.attrs'),
    Mutant("artefact with parameters in another order is accepted", "artefacts/schema.py",
           "names[: len(THETA_NAMES)] != THETA_NAMES", "set(names[: len(THETA_NAMES)]) != set(THETA_NAMES)"),
    Mutant("change in groups divides by the prior of theta, not of the ratio", "persons/cohort/infer.py",
           "Quantity(RatioPrior(theta),", "Quantity(theta,"),
    Mutant("falls are counted from a rise on", "persons/change/ratios.py",
           "(joint < -beyond)", "(joint < beyond)"),
    Mutant("pairs of one person with a large statistic count as extreme", "persons/change/ratios.py",
           "(simulated <= observed)", "(simulated >= observed)"),
    Mutant("ties count whole in the rank of the truth", "checks/calibration/ranks.py",
           "0.5 * (weight @ (draws == truth))", "(weight @ (draws == truth))"),
    Mutant("post-peak error is that before the peak", "checks/scores.py",
           "after = phase >= phase", "after = phase <= phase"),
    Mutant("slope of the isometric stiffness in k_ATP", "checks/identifiability/quantities.py",
           "exponent / np.expm1(exponent)", "exponent / np.exp(exponent)"),
    Mutant("power scaling weighs by the whole density", "checks/identifiability/power_scaling.py",
           "smooth((alpha - 1.0) * log_density)", "smooth(alpha * log_density)"),
    Mutant("errors of the model in one cell count as independent", "checks/identifiability/information.py",
           "whole * ((turned * slope[:, None, :]) @ together)", "turned * np.swapaxes(turned, 1, 2)"),
    Mutant("configuration merged over another replaces whole sections", "config/read.py",
           "overlay(below, value) if both else value", "value"),
    Mutant("predictive checks may take more draws than there are", "config/models.py",
           "if wanted > available:", "if wanted > wanted:"),
    Mutant("factor 2 in the modulus of the wall's own energy", "studies/validation/hearts/passive.py",
           "1e-3 * 0.25 *", "1e-3 * 0.5 *"),
    Mutant("relaxation by k_SR drives contraction", "heart/equations.py",
           "activation - theta.k_sr * (1.0 - activation)", "activation + theta.k_sr * (1.0 - activation)"),
    Mutant("cavity of the mid-wall sphere is too large", "heart/equations.py",
           "stretch - 0.5 * delta * inverse * inverse", "stretch + 0.5 * delta * inverse * inverse"),
    Mutant("length dependence may leave fewer bonds than none", "heart/equations.py",
           "return max(1.0 + share * (value - 1.0), 0.0)", "return 1.0 + share * (value - 1.0)"),
    Mutant("division by the prior lost in the likelihood of a population", "persons/cohort/model.py",
           "draws.log_weight - log_prior]", "draws.log_weight]"),
    Mutant("truncation of the population's law lost", "persons/cohort/model.py",
           "LOG_ROOT_TWO_PI + log_mass)", "LOG_ROOT_TWO_PI)"),
    Mutant("outliers lose the weights of their draws", "persons/cohort/model.py",
           "p * own * np.exp(-largest)", "p * np.exp(-largest)"),
    Mutant("factor 1/2 lost in the slope of the log speed", "measurement/speeds.py",
           "slope=0.5 * (passive_slope", "slope=(passive_slope"),
    Mutant("failed simulation has likelihood one", "measurement/likelihood.py",
           "np.where(np.isnan(total), -np.inf, total)", "np.where(np.isnan(total), 0.0, total)"),
    Mutant("ratio and middle factor of the passive stiffness change places", "measurement/likelihood.py",
           "ratio, middle_factor, speed_scale = (", "middle_factor, ratio, speed_scale = ("),
    Mutant("passive wall that should soften stiffens", "measurement/speeds.py",
           "np.log(_column(self.ratio)) * shortening +", "-np.log(_column(self.ratio)) * shortening +"),
    Mutant("what earlier phases tell of shared errors is lost", "measurement/shared_error.py",
           "(distance[:, i] - mean @ row)", "distance[:, i]"),
    Mutant("covariance of both errors of a cell with the wrong sign", "measurement/instants.py",
           "cross - gain_n * gain_m", "cross + gain_n * gain_m"),
    Mutant("standardisation enters the flow's density with the wrong sign", "networks/flow/flow.py",
           "log_slope - np.log(flow.eta.scale).sum()", "log_slope + np.log(flow.eta.scale).sum()"),
    Mutant("points of a cell weighed by 1/se", "networks/flow/cells.py",
           "relative_se**-2.0", "relative_se**-1.0"),
    Mutant("all subjects of a pool have the same noise", "networks/paper/pool.py",
           'generator(seed, "feature noise", subject.context.subject)', 'generator(seed, "feature noise")'),
    Mutant("chance of the untreated is put on twice", "persons/planning/likelihoods.py",
           "return moved - _slope", "return moved + _slope"),
    Mutant("what persons were told beforehand counts as told by their recordings",
           "persons/planning/likelihoods.py",
           "np.clip(1.0 - spread, LEAST_CONTRACTION, 1.0)", "np.ones_like(spread)"),
    Mutant("ejection fraction taken for what stays", "population/contexts.py",
           "(1.0 - _ejection_fraction(body, age_years, deviation[4]))",
           "_ejection_fraction(body, age_years, deviation[4])"),
    Mutant("populations that are tested spread as in training", "population/contexts.py",
           "population.broad_share) and broad", "population.broad_share)"),
    Mutant("gap of missing phases one step too short", "population/conditions.py",
           "(_longest_run(~measured) + 1)", "_longest_run(~measured)"),
    Mutant("prior lost in the importance weights", "posterior/adaptive.py",
           "log_parts[0] + drawn.log_likelihood - logsumexp", "drawn.log_likelihood - logsumexp"),
    Mutant("limit of the Pareto shape by the natural logarithm", "posterior/importance.py",
           "1.0 / np.log10(", "1.0 / np.log("),
    Mutant("a draw of the measurement is taken whatever its weight", "posterior/marginal.py",
           "np.argmax(log_ratio + gumbel.T, axis=0)", "np.argmax(gumbel.T, axis=0)"),
    Mutant("slope of the logit's map with the wrong sign", "posterior/space.py",
           "eta, -log_jacobian(eta, self.prior)", "eta, log_jacobian(eta, self.prior)"),
    Mutant("proposals fitted to the draws that they weight", "posterior/adaptive.py",
           "draws.of(half != own) for draws in placed], log_weight[half != own]",
           "draws.of(half == own) for draws in placed], log_weight[half == own]"),
    Mutant("all proposals count alike, whatever their draws", "posterior/adaptive.py",
           "np.array(counts)[:, None] / draws", "np.full((len(counts), 1), 1.0 / len(counts))"),
    Mutant("noise is fitted by plain, not restricted likelihood", "recording/noise/components.py",
           " + np.log(of_cell).sum()", ""),
    Mutant("noise between sweeps lost in the standard errors", "recording/noise/errors.py",
           "noise.repeat_fraction**2 + noise.sweep_fraction**2", "noise.repeat_fraction**2"),
    Mutant("effects of sweeps enter the likelihood with the wrong sign", "recording/noise/sweeps.py",
           "crossed -= self.variance[SWEEP]", "crossed += self.variance[SWEEP]"),
    Mutant("intervals of noise by the whole quantile of chi-squared", "recording/noise/components.py",
           "drop = 0.5 * float(chdtri", "drop = float(chdtri"),
    Mutant("error of a mean over repeats falls with their root alone", "recording/speed.py",
           "np.sqrt(by_phase.sums(variance)) / by_phase.sizes",
           "np.sqrt(by_phase.sums(variance)) / np.sqrt(by_phase.sizes)"),
    Mutant("two accepted pushes are refused", "recording/pushes.py",
           "accepted.sum() < LEAST_PUSHES", "accepted.sum() <= LEAST_PUSHES"),
    Mutant("page warns of coverage where its lower limit is below nominal", "report/page/sections.py",
           'table["ci_high"] < table["nominal"]', 'table["ci_low"] < table["nominal"]'),
    Mutant("predicted volume above the measured is called below", "report/tables/subjects.py",
           'row["low"] > row["measured"]', 'row["low"] < row["measured"]'),
    Mutant("relative difference of two runs by the smaller value", "study/inspect.py",
           "np.maximum(np.abs(a), np.abs(b))", "np.minimum(np.abs(a), np.abs(b))"),
    Mutant("error of a planned mean does not fall with the root of repeats", "study/plan.py",
           "/ repeats) ** 0.5", "/ repeats)"),
    Mutant("steep rise between two pushes is an outlier", "recording/neighbours.py",
           "far = (z > limit) & _beyond(log_speed, BEYOND * limit * factor * se)", "far = z > limit"),
    Mutant("nuisances have no strips at their bounds", "verdict/misfits.py",
           "enumerate(prior.names)", "enumerate(prior.names[:4])"),
    Mutant("strips of the prior at the upper bound alone", "verdict/misfits.py",
           "(below[:, column], 1.0 - below[:, column])", "(1.0 - below[:, column], 1.0 - below[:, column])"),
    Mutant("recording judged among null recordings of any number of points", "verdict/nulls.py",
           "distance <= reach", "distance >= 0.0"),
    Mutant("smaller of two p-values counts as one", "verdict/nulls.py",
           "** test_p.shape[1]", "** 1"),
    Mutant("tail of a null distribution begins at the wrong end", "verdict/nulls.py",
           "np.quantile(ordered, 1.0 - tail_fraction)", "np.quantile(ordered, tail_fraction)"),
    Mutant("contradicted recordings are the likely ones", "verdict/nulls.py",
           "(overall <= rule.contradicted_level)", "(overall > rule.contradicted_level)"),
    Mutant("volume that does not fit makes a contradicted recording doubtful", "verdict/recording.py",
           "return max(overall, Grade.DOUBTFUL)", "return Grade.DOUBTFUL"),
    Mutant("scale of speeds differs from repeat to repeat", "recording/acquisition.py",
           "settings.scale_fraction * generator.standard_normal()",
           "settings.scale_fraction * generator.standard_normal(settings.repeats)"),
    Mutant("drug acts before the first visit", "virtual/trial/persons.py",
           "(group, visit) == (TREATED, AFTER)", "group == TREATED"),
    Mutant("flow keeps the weights of its last epoch", "networks/flow/training.py",
           "            self._best = copy.deepcopy(self._net.state_dict())",
           "            self._best = self._net.state_dict()"),
    Mutant("what the others of a folder gain has the wrong sign", "recording/noise/folder.py",
           "max(0.0, 2.0 * gained)", "max(0.0, -2.0 * gained)"),
    Mutant("ectopic beats place phases that were not measured", "recording/ingest.py",
           "~ectopic(samples, settings.max_rr_deviation_fraction)", "np.ones(samples.status.shape, bool)"),
    Mutant("median RR over samples, not over beats", "recording/samples.py",
           "np.median(self.beats_rr_ms)", "np.median(self.rr_ms)"),
    Mutant("limit of the Pareto shape is that of many draws", "posterior/adaptive.py",
           "k_hat_limit(draws, settings.max_k_hat)", "settings.max_k_hat"),
)  # fmt: skip


@dataclass(frozen=True)
class Run:
    """Tests that failed, by file and name without parameters, and how long all of them took."""

    failed: frozenset[str]
    seconds: float


def copied(root: Path, folder: Path) -> Path:
    """Copy the files of a project that are in its repository, or could be."""
    listing = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(listing, cwd=root, check=True, capture_output=True, text=True).stdout
    for name in filter(None, listed.split("\0")):
        if (root / name).is_file():  # one that was deleted is listed still
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, folder / name)
    found = started(["-c", "import swesbi; print(swesbi.__file__)"], folder).communicate()[0].strip()
    if Path(found) != folder / SOURCE / "__init__.py":
        raise RuntimeError(f"tests of {folder} would import {found}")
    return folder


def tested(folder: Path, suite: tuple[str, ...], timeout_s: float) -> Run:
    """Run tests of a copy of the project."""
    report, began = folder.with_suffix(".xml"), time.monotonic()
    report.unlink(missing_ok=True)
    options = ["-q", "-p", "no:cacheprovider", "--continue-on-collection-errors", f"--junitxml={report}"]
    process = started(["-m", "pytest", *options, "-m", FAST, *suite], folder)
    try:
        process.communicate(timeout=timeout_s)
        failed = frozenset(failures(report)) if report.exists() else frozenset({NOTHING_RUN})
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        failed = frozenset({TIMEOUT})
    return Run(failed, time.monotonic() - began)


def started(arguments: Sequence[str], folder: Path) -> subprocess.Popen[str]:
    """Start Python in a copy, whose sources come before the installed ones.

    Byte code is not kept, since it is told by size and second of the source. Compiled kernels are, beside
    the copy: they are told by what all sources of the heart say.
    """
    own = {"PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(folder.with_suffix(".numba"))}
    return subprocess.Popen(
        [sys.executable, *arguments],
        cwd=folder,
        env={**os.environ, **own, "PYTHONDONTWRITEBYTECODE": "1", "OMP_NUM_THREADS": "1"},
        text=True,
        start_new_session=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


def failures(report: Path) -> Iterator[str]:
    """Yield the tests of a report of pytest that failed, or the file that cannot be read."""
    for case in ElementTree.parse(report).iter("testcase"):
        if case.find("failure") is not None or case.find("error") is not None:
            module, name = case.get("classname", ""), case.get("name", "").split("[")[0]
            yield f"{module.replace('.', '/')}.py::{name}" if module else f"{name.replace('.', '/')}.py"


def killers(mutants: Sequence[Mutant], root: Path, workers: int) -> Iterator[tuple[Mutant, Run]]:
    """Yield each mutant with the tests that it fails, those left out that fail without it."""
    with TemporaryDirectory(prefix="mutants-") as parent, ThreadPoolExecutor(workers) as pool:
        copies: SimpleQueue[Path] = SimpleQueue()
        for number in range(workers):
            copies.put(copied(root, Path(parent).resolve() / str(number)))

        def run(suite: tuple[str, ...], timeout_s: float, mutant: Mutant | None = None) -> Run:
            folder = copies.get()
            try:
                with nullcontext() if mutant is None else mutant.applied(folder):
                    return tested(folder, suite, timeout_s)
            finally:
                copies.put(folder)

        suites = list(dict.fromkeys(mutant.suite for mutant in mutants))
        intact = dict(zip(suites, pool.map(lambda suite: run(suite, LONGEST_S), suites), strict=True))
        for suite, without in intact.items():
            print(f"{' '.join(suite)}: {without.seconds:.0f} s without a mutant", flush=True)
            if without.failed & {TIMEOUT, NOTHING_RUN}:
                raise RuntimeError(f"{' '.join(suite)}: {', '.join(without.failed)} without a mutant")
            for name in sorted(without.failed):
                print(f"  fails without a mutant, and kills none: {name}", flush=True)

        def mutated(mutant: Mutant) -> Run:
            without = intact[mutant.suite]
            made = run(mutant.suite, SLOWER * without.seconds + SPARE_S, mutant)
            return Run(made.failed - without.failed, made.seconds)

        yield from zip(mutants, pool.map(mutated, mutants), strict=True)


def table_of(found: Mapping[str, frozenset[str]], former: pd.DataFrame) -> pd.DataFrame:
    """Return a row for each mutant that was run, or that a former table has, in the order of ``MUTANTS``."""
    kept = dict(zip(former["mutant"], former["killed_by"], strict=True))
    said = kept | {name: SEPARATOR.join(sorted(tests)) for name, tests in found.items()}
    rows = [
        (mutant.name, mutant.package, by := said[mutant.name], len(by.split(SEPARATOR)) if by else 0)
        for mutant in MUTANTS
        if mutant.name in said
    ]
    return pd.DataFrame(rows, columns=list(COLUMNS))


def read_table(path: Path) -> pd.DataFrame:
    """Return a table of killers, empty where there is none yet."""
    return pd.read_csv(path, keep_default_na=False) if path.is_file() else pd.DataFrame(columns=list(COLUMNS))


def main() -> int:
    """Run the mutants; return 1 where one lives that the stored table says is killed."""
    parser = argparse.ArgumentParser(description="Run mutants against the tests of their packages.")
    parser.add_argument("names", nargs="*", metavar="NAME", help="of mutants or packages; default: all")
    parser.add_argument("--out", type=Path, help="table to write; rows of mutants that are not run stay")
    parser.add_argument("--workers", type=int, default=2, help="runs side by side")
    parser.add_argument("--compare", type=Path, default=ROOT / STORED, help=f"default: {STORED}")
    parser.add_argument("--root", type=Path, default=ROOT, help="project that is tested; default: this one")
    options = parser.parse_args()
    for mutant in MUTANTS:
        mutant.edited(options.root)
        if absent := [path for path in mutant.suite if not (options.root / path).exists()]:
            parser.error(f"{absent[0]} is not there any more: correct TESTS")
    known = {text for mutant in MUTANTS for text in (mutant.name, mutant.package)}
    if unknown := [name for name in options.names if name not in known]:
        parser.error(f"{unknown[0]!r} is neither a mutant nor a package of one")
    chosen = [m for m in MUTANTS if not options.names or {m.name, m.package} & {*options.names}]
    stored, found = read_table(options.compare), {}
    for number, (mutant, run) in enumerate(killers(chosen, options.root.resolve(), options.workers), start=1):
        found[mutant.name] = run.failed
        by = f"killed by {len(run.failed)}" if run.failed else "ALIVE"
        print(f"{number}/{len(chosen)} {mutant.name}: {by} ({run.seconds:.0f} s)", flush=True)
        if options.out is not None:  # whoever stops it keeps what there is
            table_of(found, read_table(options.out)).to_csv(options.out, index=False, lineterminator="\n")
    killed = set(stored.loc[stored["number"] > 0, "mutant"])
    lost = [name for name, tests in found.items() if not tests and name in killed]
    for name in lost:
        print(f"no test notices any more: {name}")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
