r"""Curves that no heart makes, and wild values: does the verdict raise an alarm, is the wild value left out?

    python -m studies.validation.nonsense
    python -m studies.validation.nonsense --results results --hearts 40 --csv nonsense.csv

Needs the network of a population, trained under the shipped configuration. The curves of hearts of the
study's own generator (a, README.md), of a stream of their own, are changed and recorded: gated, at the
noise of the study, and as a push train (`data/virtual_push_trains`). Each is answered as a subject outside
the study is, with fewer draws and rounds, and shorter Markov chains. A row a change and form of recording:
how many are refused, doubtful, contradicted.

Where one value is wild, the row also has how many recordings name it, and in how many the medians of
`k_0`, `k_ATP` and `k_SR` lie within 0.3 posterior standard deviations of those without the wild value.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, asked_of, recorded_as_answered
from studies.validation.pushes import DECLARED, recording_of_table
from studies.validation.settings import configured
from swesbi.answers.answer import Answer, answered
from swesbi.answers.knowledge import Knowledge
from swesbi.answers.recording import ModelledRecording
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.config.read import read_merged
from swesbi.config.study import load_study
from swesbi.parameters import OF_THETA
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.settings import asking
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.phases import sample_cycle
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.speed import NoiseComponents
from swesbi.recording.tables.columns import SPEED, STATUS_OK
from swesbi.seeds import generator
from swesbi.study.results import Results, population_files
from swesbi.verdict.verdict import Status
from swesbi.virtual.hearts.heart import OtherHeart
from swesbi.virtual.push_trains import record_train

STREAM: Final = "nonsense"
PHASE: Final = (np.arange(200) + 0.5) / 200
"""Of changed curves."""
KNOTS: Final = 20  # independent values of a curve of noise
NOISE_LOG_SD: Final = 0.8  # of these, a factor of 1.5 in speed
WILD: Final = 2.5  # times the speed
NEAR_SD: Final = 0.3
EFFECTIVE_DRAWS, DRAWS = 300, 1000
"""Of each posterior: its tests are among null recordings with fewer."""
ROUNDS, STEPS = 12, 20
"""Of weighted draws, and of the chains after them. No sampler converges on a curve that no heart makes."""
Change = Callable[[FloatArray, np.random.Generator], FloatArray]


def _shifted(stiffness: FloatArray, cycles: float) -> FloatArray:
    return np.asarray(sample_cycle(PHASE, stiffness[None], (PHASE - cycles) % 1.0)[0])


def late_peak(stiffness: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return one wave in late systole, as high as the heart's own."""
    low, high = np.quantile(stiffness, 0.05), stiffness.max()
    middle, width = rng.uniform(0.5, 0.6), rng.uniform(0.08, 0.13)
    return np.asarray(low + (high - low) * np.exp(-0.5 * ((PHASE - middle) / width) ** 2))


def noise(stiffness: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return a curve of independent values about the heart's mean."""
    knots = (np.arange(KNOTS) + 0.5) / KNOTS
    log_values = NOISE_LOG_SD * rng.standard_normal(KNOTS)
    return np.asarray(stiffness.mean() * np.exp(sample_cycle(knots, log_values[None], PHASE)[0]))


CURVES: Final[Mapping[str, Change]] = {
    "late peak": late_peak,
    "trigger at the T wave": lambda e, rng: _shifted(e, -rng.uniform(0.33, 0.42)),
    "two peaks": lambda e, _: sample_cycle(PHASE, e[None], (2.0 * PHASE) % 1.0)[0],
    "reversed": lambda e, _: e[::-1],
    "a quarter late": lambda e, _: _shifted(e, 0.25),
    "clipped at half": lambda e, _: np.minimum(e, 0.5 * (e.min() + e.max())),
    "flat": lambda e, _: np.full_like(e, e.mean()),
    "noise": noise,
}
"""Stiffness at ``PHASE`` of a heart, in kPa, and what it becomes; shape (200,)."""
SPIKE: Final = "one push or phase at 2.5 times"
SAMPLE: Final = "one sample at 2.5 times"


@dataclass(frozen=True)
class Questions:
    """What records and answers changed hearts.

    Attributes:
        knowledge: What answers.
        noise: Of the study's cohort.
        settings: Of the hearts and their answers.
        seed: The study's seed.
    """

    knowledge: Knowledge
    noise: NoiseComponents
    settings: HeartAnswersSettings
    seed: int

    def rows(self, number: int) -> Iterator[dict[str, object]]:
        """Yield a row a change and form of recording, of the heart of this number."""
        heart = self.settings.recorded(number, self.seed).heart
        for name, change in CURVES.items():
            rng = generator(self.seed, STREAM, name, number)
            curve = heart.curve
            own = sample_cycle(curve.cycle_phase, curve.stiffness_kpa[None], PHASE)[0]
            changed = replace(heart, curve=TruthCurve(PHASE, change(own, rng)))
            for form, answer in (("gated", self.gated), ("pushes", self.pushes)):
                yield {"change": name, "form": form} | _outcome(answer, changed, rng)
        for form, wild in (("gated", SPIKE), ("gated", SAMPLE), ("pushes", SPIKE)):
            yield {"change": wild, "form": form} | self.wild(heart, form, wild, number)

    def gated(self, heart: OtherHeart, rng: np.random.Generator) -> Answer:
        """Record a heart at gated phases, and answer it."""
        return self._gated(heart, acquire(heart.curve, heart.context, self.settings.acquisition, rng))

    def pushes(self, heart: OtherHeart, rng: np.random.Generator) -> Answer:
        """Record a heart by a push train, and answer it."""
        return self._pushes(heart, record_train(heart.curve, heart.context, rng))

    def wild(self, heart: OtherHeart, form: str, wild: str, number: int) -> dict[str, object]:
        """Answer a recording with a wild value and without; say whether it was left out and moved nothing."""
        rng = generator(self.seed, STREAM, wild, form, number)
        try:
            if form == "gated":
                samples = acquire(heart.curve, heart.context, self.settings.acquisition, rng)
                clean, answer = self._gated(heart, samples), self._gated(heart, with_wild(samples, wild, rng))
            else:
                table = record_train(heart.curve, heart.context, rng)
                row = rng.choice(np.flatnonzero(table["status"] == STATUS_OK))
                spoilt = table.assign(**{SPEED: table[SPEED].where(table.index != row, WILD * table[SPEED])})
                clean, answer = self._pushes(heart, table), self._pushes(heart, spoilt)
        except (RecordingError, NoLikelihoodError):
            return {"status": "refused"}
        named, near = _outliers(answer) > _outliers(clean), _distance(answer, clean) < NEAR_SD
        return {"status": str(answer.verdict.status), "named": named, "near": near}

    def _gated(self, heart: OtherHeart, samples: Samples) -> Answer:
        settings = self.settings
        observation = ingest(samples, heart.context, settings.recording, settings.grid_points)
        return self._answer(recorded_as_answered(observation, samples, self.noise, settings))

    def _pushes(self, heart: OtherHeart, table: pd.DataFrame) -> Answer:
        return self._answer(recording_of_table(table, heart.context, DECLARED, self.settings))

    def _answer(self, recording: ModelledRecording) -> Answer:
        return answered(recording, self.knowledge, self.settings, self.seed)


def _outcome(
    answer: Callable[[OtherHeart, np.random.Generator], Answer], heart: OtherHeart, rng: np.random.Generator
) -> dict[str, object]:
    try:
        return {"status": str(answer(heart, rng).verdict.status)}
    except (RecordingError, NoLikelihoodError):
        return {"status": "refused"}


def with_wild(samples: Samples, wild: str, rng: np.random.Generator) -> Samples:
    """Return a recording with one wild sample, or a phase all of whose samples are."""
    one = rng.choice(np.flatnonzero(samples.status == STATUS_OK))
    of_phase = samples.phase_index == samples.phase_index[one]
    chosen = of_phase if wild == SPIKE else np.arange(len(of_phase)) == one
    return replace(samples, speed_m_s=np.where(chosen, WILD, 1.0) * samples.speed_m_s)


def _outliers(answer: Answer) -> int:
    return answer.recording.observation.rejected.get("outlier", 0)


def _distance(answer: Answer, clean: Answer) -> float:
    """Return by how many standard deviations a median of theta differs at most."""
    spoilt, own = (np.log(one.posterior.phi[:, OF_THETA]) for one in (answer, clean))
    return float(np.max(np.abs(np.median(spoilt, axis=0) - np.median(own, axis=0)) / own.std(axis=0)))


def with_fewer_draws(settings: HeartAnswersSettings) -> HeartAnswersSettings:
    """Return the same, with posteriors of fewer draws, rounds and steps."""
    mcmc = settings.exact.mcmc.model_copy(update={"steps": STEPS})
    fewer = settings.exact.model_copy(update={"draws": DRAWS, "max_rounds": ROUNDS, "mcmc": mcmc})
    return settings.model_copy(update={"exact": asking(fewer, EFFECTIVE_DRAWS)})


def table_of(rows: Sequence[Mapping[str, object]]) -> pd.DataFrame:
    """Return a row a change and form: recordings by status, and of wild values those named and near."""
    found = pd.DataFrame(rows, columns=["change", "form", "status", "named", "near"])
    found = found.astype({"named": float, "near": float})  # NaN where nothing is wild
    words = [Status.NOT_CONTRADICTED, Status.UNINFORMATIVE, Status.DOUBTFUL, Status.CONTRADICTED, "refused"]
    counts = found.groupby(["change", "form"], sort=False)["status"].value_counts().unstack(fill_value=0)
    counts = counts.reindex(columns=[str(word) for word in words], fill_value=0)
    wild = found.groupby(["change", "form"], sort=False)[["named", "near"]].sum(min_count=1)
    return counts.join(wild).reset_index()


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer the changed hearts; print and write the table.

    Raises:
        ConfigError: The configuration has no such experiment.
        OSError: The network has not been trained.
    """
    parser = argparse.ArgumentParser(prog="python -m studies.validation.nonsense", description=__doc__)
    parser.add_argument("--results", type=Path, help="of a finished study; default: as configured")
    parser.add_argument("--hearts", type=int, default=40, help="default: 40")
    parser.add_argument("--csv", type=Path, help="where the table goes")
    options = parser.parse_args(arguments)
    study = load_study(read_merged(Path("config.yaml")))
    results = options.results or Path(study.config.results)
    finished = population_files(Results(results), configured().experiment)
    finished.check()
    settings = with_fewer_draws(asked_of(study, "a", options.hearts, STREAM))
    cohort = Results(results).noise.usual
    asked = Questions(finished.knowledge(), cohort, settings, study.config.seed)
    rows: list[dict[str, object]] = []
    for number in settings.numbers:
        rows += asked.rows(number)
        print(f"heart {number + 1} of {options.hearts}", flush=True)
    table = table_of(rows)
    print(table.to_string(index=False))
    if options.csv is not None:
        write_csv(options.csv, table)


if __name__ == "__main__":
    main()
