r"""Whether a gated recording, given as pushes with errors of their own, has the posterior that it has.

    python -m studies.validation.gated_as_pushes
    python -m studies.validation.gated_as_pushes --results results --subjects 20 --csv gated_as_pushes.csv

Needs the network of a population, trained under the shipped configuration. Hearts of streams of development
(README.md) are recorded as the validation records them, their repeats as separate ones, since pushes
share no error of a sweep. Each is answered twice, as a subject outside the study is: once as it is, once from
a file with a row a measured phase, its time since the R peak, its mean speed and the standard error of that.
Rounds of either go on to four times as many effective draws as are kept, so that hardly one is kept twice.
A classifier then tells the draws of the two answers apart by all parameters, nuisances included: 0.5 means
that it cannot. Draws that are kept several times it would know by their copies.

A line a heart: by how much the log-likelihoods of the two differ at most at the draws of the first, less
their mean difference, efficiency and sampler of both answers, C2ST. A heart that the network does not answer
for is named and left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, asked_of
from studies.validation.settings import configured
from swesbi.answers.recording import ModelledRecording, modelled_pushes
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.checks.calibration.local import classifier_accuracy
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.context import Context
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording, measured_speeds
from swesbi.networks.flow.files import load_flow
from swesbi.networks.flow.flow import TrainedFlow, flow_proposal
from swesbi.population.settings import in_declared_range
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.settings import asking
from swesbi.recording.noise.cohort import read_noise
from swesbi.recording.pushes import ingest_pushes
from swesbi.recording.reader import samples_in
from swesbi.recording.settings import NoiseDeclaration
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.tables.frame import table_of_frame
from swesbi.seeds import integer_seed
from swesbi.study.finished import finished_population
from swesbi.study.other_network import check_network
from swesbi.virtual.hearts.recorded import RecordedHeart

STREAM: Final = "gated as pushes"


@dataclass(frozen=True)
class Row:
    """One heart through both doors."""

    subject: str
    log_likelihoods_differ: float
    gated_efficiency: float
    gated_sampler: str
    pushes_efficiency: float
    pushes_sampler: str
    c2st: float

    def line(self) -> str:
        """Return the row as :data:`HEAD` has it."""
        gated = f"{self.gated_efficiency:10.3f}  {self.gated_sampler:11s}"
        pushes = f"{self.pushes_efficiency:10.3f}  {self.pushes_sampler:11s}"
        return f"{self.subject:24s}{self.log_likelihoods_differ:10.1e}{gated}{pushes}{self.c2st:8.3f}"


HEAD: Final = f"{'heart':24s}{'log lik.':>10s}{'gated':>10s}  {'':11s}{'pushes':>10s}  {'':11s}{'C2ST':>8s}"


@dataclass(frozen=True)
class BothDoors:
    """What answers a heart twice.

    Attributes:
        flow: The population's network.
        noise: Noise of the study's cohort, of separate repeats.
        settings: Of the hearts and of their answers.
        draws: Draws of each answer that the classifier sees.
        seed: The study's seed.
    """

    flow: TrainedFlow
    noise: NoiseComponents
    settings: HeartAnswersSettings
    draws: int
    seed: int

    def rows(self) -> Iterator[Row]:
        """Yield a row for each heart that the network answers for; print why it does not for another."""
        asked = self.settings
        for number in range(asked.hearts):
            made = asked.recorded(number, self.seed)
            context = made.heart.context
            if outside := in_declared_range(context, asked.population):
                print(f"{context.subject:24s}refused: {'; '.join(outside)}", flush=True)
                continue
            yield self.row(made)

    def row(self, made: RecordedHeart) -> Row:
        """Answer one heart through both doors."""
        gated = SpeedModel(measured_speeds(made.observation, self.noise), self.settings.exact_posterior.model)
        pushes = self.as_pushes(gated.recording)
        asked, subject = self.settings.exact_posterior.exact, gated.recording.subject
        exact = asking(asked, 4 * asked.draws).model_copy(update={"max_rounds": 60})
        first, _ = exact_posterior(
            HeartModel(gated),
            flow_proposal(self.flow, gated.recording),
            exact,
            self.seed,
            STREAM,
            "gated",
            subject,
        )
        second, _ = exact_posterior(
            HeartModel(pushes),
            flow_proposal(self.flow, pushes.recording),
            exact,
            self.seed,
            STREAM,
            "pushes",
            subject,
        )
        accuracy = classifier_accuracy(
            first.phi[: self.draws], second.phi[: self.draws], gated.settings.prior,
            integer_seed(self.seed, STREAM, "c2st", subject),
        )  # fmt: skip
        return Row(
            subject, _difference(gated, pushes, first.phi[: self.draws]), first.efficiency, first.sampler,
            second.efficiency, second.sampler, accuracy,
        )  # fmt: skip

    def as_pushes(self, recording: SpeedRecording) -> SpeedModel:
        """Write a gated recording as a table of pushes, read that as any, and return its model."""
        period_ms = 1e3 * recording.context.period_s
        table = pd.DataFrame(
            {
                "time_ms": recording.phase * period_ms,
                "rr_ms": period_ms,
                "shear_wave_speed_m_s": recording.speed_m_s,
                "se_m_s": recording.relative_se * recording.speed_m_s,
            }
        )
        return recording_of_table(table, recording.context, NoiseDeclaration(), self.settings).model


def recording_of_table(
    table: pd.DataFrame, context: Context, declared: NoiseDeclaration, settings: HeartAnswersSettings
) -> ModelledRecording:
    """Read a table of pushes, as that of any subject, and return the recording with its model.

    Raises:
        RecordingError: It cannot be used.
    """
    quality = settings.recording
    in_memory = table_of_frame(table, context.subject)
    samples = samples_in(in_memory, quality.phases, quality.density_kg_m3)
    observed = ingest_pushes(samples, context, quality, declared)
    return modelled_pushes(observed, settings.exact_posterior.model)


def _difference(gated: SpeedModel, pushes: SpeedModel, phi: FloatArray) -> float:
    difference = gated.log_likelihood(phi) - pushes.log_likelihood(phi)
    return float(np.abs(difference - difference.mean()).max())


def both_doors(study: Study, options: argparse.Namespace) -> BothDoors:
    """Return what answers the hearts that are asked for.

    Raises:
        OtherNetworkError: The network was trained under other settings.
        ArtefactError: A file is no such artefact.
    """
    experiment = configured().experiment
    finished = finished_population(options.results, experiment)
    settings = asked_of(study, options.generator, options.subjects, STREAM)
    check_network(finished.estimator, settings.train_population.to_plain())
    base = study.config.base_of(experiment)
    draws = study.config.speed_experiments[base].calibration.local.two_sample_draws
    noise = read_noise(finished.noise).usual.of_separate_repeats
    return BothDoors(load_flow(finished.estimator)[0], noise, settings, draws, study.config.seed)


def main() -> None:
    """Answer the hearts through both doors, and print a line a heart and what they come to."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--subjects", type=int, default=20, help="how many hearts; default: 20")
    parser.add_argument("--generator", default="a", metavar="LETTER", help="whose hearts; default: a")
    parser.add_argument("--csv", type=Path, help="table to write, a row a heart")
    options = parser.parse_args()
    study = load_study(read_merged(options.config), str(options.config))
    print(HEAD, flush=True)
    rows = []
    for row in both_doors(study, options).rows():
        print(row.line(), flush=True)
        rows.append(row)
    if not rows:
        raise SystemExit("the network answers for none of these hearts")
    accuracy = np.array([row.c2st for row in rows])
    print(f"{len(rows)} hearts: C2ST {accuracy.mean():.3f} in the mean, {accuracy.max():.3f} at most")
    if options.csv:
        write_csv(options.csv, pd.DataFrame([asdict(row) for row in rows]))


if __name__ == "__main__":
    main()
