"""Subjects that the network has not seen: seconds an answer takes, how it compares with long Markov chains.

    python benchmarks/infer.py
    python benchmarks/infer.py --subjects 3
    python benchmarks/infer.py --network 20

Needs a finished study of the shipped configuration. Generated subjects are answered by `infer`,
each in a process of its own; then a classifier tells their draws from those of MCMC (0.5: it cannot).
Three subjects whose contexts lie outside are handed in as well.

With --network the network alone is measured, on so many recordings that the model makes of each context:
the share of its draws that is effective at the heart rates that it knows, between them, beyond the fastest,
and where values that only steer it are a quarter larger than a subject's; as they are, and as `infer`
shows them to it, moved into the range that it knows.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
from generated import generate, write

from swesbi.checks.calibration.local import classifier_accuracy
from swesbi.checks.calibration.settings import LocalSettings
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings, speed_model
from swesbi.networks.flow.flow import flow_proposal
from swesbi.networks.flow.trained import TrainedFlow
from swesbi.population.synthetic import own_recordings
from swesbi.posterior.adaptive import adapted
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.mcmc import sample_mcmc, starting_points
from swesbi.posterior.result import ExactPosterior
from swesbi.posterior.settings import ExactSettings
from swesbi.recording.noise.cohort import CohortNoise
from swesbi.recording.observation import Observation
from swesbi.study.answerer import Answerer
from swesbi.study.results import experiment_files
from swesbi.verdict.context import nearest_known

FIRST_UNSEEN = 50  # the numbers below made the choice of the discrepancy
SEED = 1
DRAWS = 2000  # of the one round of weights
BEYOND = (1.05, 1.1)  # of the fastest heart rate
LARGER = 1.25  # of values that only steer the network
OUTSIDE = {"hr_bpm": 130.0, "lvedv_ml": 210.0, "ivsd_cm": 1.4}


def answer(
    cohort: Path, subject: str, experiment: str, out: Path
) -> tuple[float, subprocess.CompletedProcess[str]]:
    """Return the wall time (s) of one answer in a process of its own, and what the process said."""
    command = [sys.executable, "-m", "swesbi", "infer", str(cohort), "--subject", subject]
    asked = ["--experiment", experiment, "--out", str(out)]
    begin = time.perf_counter()
    done = subprocess.run([*command, *asked], capture_output=True, text=True, check=False)
    return time.perf_counter() - begin, done


def accuracy(folder: Path, model: SpeedModel, sizes: LocalSettings) -> float:
    """Return the accuracy of telling the reported draws from long Markov chains; NaN if these fail."""
    exact, mcmc = ExactPosterior.read(folder / "posterior.h5"), sizes.mcmc
    rng = np.random.default_rng(SEED)
    heart = HeartModel(model)
    chains = sample_mcmc(heart, starting_points(heart, exact.weighted, mcmc.start_points, rng), mcmc, SEED)
    if not chains.converged:
        return float("nan")
    draws = sizes.two_sample_draws
    phi = heart.evaluated(chains.thinned(draws, rng)).phi
    return classifier_accuracy(exact.phi[:draws], phi, model.settings.prior, SEED)


def answered(study: Study, experiment: str, count: int, folder: Path) -> None:
    """Print one line for each of ``count`` unseen subjects."""
    cohort = folder / "unseen"
    made = generate(study.config, range(FIRST_UNSEEN, FIRST_UNSEEN + count))
    write(cohort, made, study.config)
    sizes = study.config.speed_experiments[experiment].calibration.local
    asked = Answerer(
        load_study(study.config.to_plain(), new_cohort=cohort), (experiment,), "", from_prior=True
    )
    print(
        f"{'subject':8}{'seconds':>8}  {'verdict':12}{'k-hat':>6}{'efficiency':>11}  "
        f"{'sampler':12}{'C2ST':>6}"
    )
    for one in made:
        subject = one.volunteer.context.subject
        seconds, done = answer(cohort, subject, experiment, folder)
        if done.returncode:
            print(f"{subject:8}{seconds:8.1f}  {done.stderr.strip()}")
            continue
        verdict = json.loads((folder / subject / "verdict.json").read_text(encoding="utf-8"))
        recording = asked.request(subject).recording
        assert recording.observation.is_gated
        told = accuracy(folder / subject, recording.model, sizes)
        print(
            f"{subject:8}{seconds:8.1f}  {verdict['status']:12}{verdict['k_hat']:6.2f}"
            f"{verdict['efficiency']:11.2f}  {verdict['sampler']:12}{told:6.3f}"
        )


def refused(study: Study, experiment: str, folder: Path) -> None:
    """Print what subjects are told whose context is not one of the pool's."""
    cohort = folder / "outside"
    made = generate(study.config, range(FIRST_UNSEEN, FIRST_UNSEEN + len(OUTSIDE)))
    write(cohort, made, study.config)
    table = pd.read_csv(cohort / "subjects.csv")
    for row, (name, value) in enumerate(OUTSIDE.items()):
        table.loc[row, name] = value
    table.to_csv(cohort / "subjects.csv", index=False)
    for subject, name in zip(table["subject"], OUTSIDE, strict=True):
        seconds, done = answer(cohort, subject, experiment, folder / "none")
        print(f"\n{subject} with another {name}: exit code {done.returncode} after {seconds:.1f} s")
        print(done.stderr.strip())


@dataclass(frozen=True)
class Case:
    """A subject of the study with another context."""

    what: str
    model: SpeedModel
    context: Context


def other_contexts(models: list[SpeedModel]) -> Iterator[Case]:
    """Yield the study's subjects by heart rate: as they are, half-way to the next, and beyond the fastest."""
    ordered = sorted(models, key=lambda model: model.recording.context.hr_bpm)
    rates = [model.recording.context.hr_bpm for model in ordered]
    for model in ordered:
        yield Case("as trained", model, model.recording.context)
    for model, one, two in zip(ordered, rates, rates[1:], strict=False):
        yield Case("heart rate between", model, replace(model.recording.context, hr_bpm=0.5 * (one + two)))
    for model in ordered:
        own = model.recording.context
        steering = {name: LARGER * getattr(own, name) for name in ("age_years", "bsa_m2", "lvesv_ml")}
        yield Case("age, BSA, LVESV larger", model, replace(own, **steering))
    for factor in BEYOND:
        beyond = replace(ordered[-1].recording.context, hr_bpm=factor * rates[-1])
        yield Case(f"heart rate {factor - 1.0:.0%} beyond", ordered[-1], beyond)


def network_alone(
    models: list[SpeedModel], flow: TrainedFlow, settings: ExactSettings, count: int
) -> pd.DataFrame:
    """Return the network's efficiency at other contexts: median, smallest and largest over recordings."""
    trained = [model.recording.context for model in models]
    settings = settings.model_copy(update={"first_draws": DRAWS, "max_rounds": 0})
    rows = []
    for case in other_contexts(models):
        recording = replace(case.model.recording, context=case.context)
        model = SpeedModel(recording, case.model.settings)
        made = own_recordings(model, count, SEED, "network", case.what).recordings
        for shown in ("as it is", "nearest known"):
            context = case.context if shown == "as it is" else nearest_known(case.context, trained)
            found = [
                adapted(
                    HeartModel(replace(model, recording=one)),
                    settings,
                    SEED,
                    flow_proposal(flow, replace(one, context=context)),
                ).weighted.efficiency
                for one in made
            ]
            row = {"context": case.what, "subject": recording.subject, "hr_bpm": case.context.hr_bpm}
            low, median, high = np.quantile(found, [0.0, 0.5, 1.0])
            rows.append(row | {"shown": shown, "median": median, "smallest": low, "largest": high})
            if context == case.context and shown == "as it is" and case.context in trained:
                break
    return pd.DataFrame(rows)


def network(study: Study, results: Path, experiment: str, count: int) -> None:
    """Print how the network alone does at contexts that it does not know."""
    files = experiment_files(study, experiment)
    settings = SpeedModelSettings.from_plain(View(study, {"experiment": experiment})["model"])
    noise = CohortNoise.read(results / "cohort" / "noise.h5")
    models = [speed_model(Observation.read(path), noise, settings) for path in files.observations]
    flow = TrainedFlow.read(files.network)
    table = network_alone(models, flow, study.config.speed_experiments[experiment].exact, count)
    print(f"efficiency of the network's draws, {count} recordings a line")
    print(table.round({"median": 4, "smallest": 4, "largest": 4}).to_string(index=False))


def main() -> None:
    """Answer, and refuse."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--experiment", default="calibrated", help="an experiment of kind speeds")
    parser.add_argument("--subjects", type=int, default=10, help="how many are answered; default: 10")
    parser.add_argument(
        "--network", type=int, metavar="RECORDINGS", help="measure the network alone, and nothing else"
    )
    options = parser.parse_args()
    study = load_study(read_merged(Path("config.yaml")))
    results = Path(study.config.results)
    if options.network:
        network(study, results, options.experiment, options.network)
        return
    with tempfile.TemporaryDirectory() as folder:
        answered(study, options.experiment, options.subjects, Path(folder))
        refused(study, options.experiment, Path(folder))


if __name__ == "__main__":
    main()
