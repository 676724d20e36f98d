"""Curves that no heart makes, and wild values: does the verdict raise an alarm, is the wild value left out?

Curves of hearts of the study's own generator (a, README.md), of a stream of their own, are changed and
recorded: gated, at the noise of the study, and as a push train (`data/virtual_push_trains`). Each is answered
as a subject outside the study is, with fewer draws and rounds, and shorter Markov chains.

Where one value is wild, it is also asked whether the recording names it, and whether the medians of `k_0`,
`k_ATP` and `k_SR` lie within 0.3 posterior standard deviations of those without the wild value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, Questioner, recorded_as_answered
from studies.validation.hearts.heart import OtherHeart
from studies.validation.pushes import DECLARED, recording_of_table
from studies.validation.settings import NONSENSE_STREAM
from swesbi.answers.answer import Answer, answered
from swesbi.answers.recording import ModelledRecording
from swesbi.base.arrays import FloatArray
from swesbi.parameters import OF_THETA
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.settings import asking
from swesbi.recording.acquisition import TruthCurve, acquire
from swesbi.recording.ingest import ingest
from swesbi.recording.phases import sample_cycle
from swesbi.recording.problems import RecordingError
from swesbi.recording.samples import Samples
from swesbi.recording.tables.layout import SPEED, STATUS_OK
from swesbi.seeds import generator
from swesbi.verdict.summary import REFUSED
from swesbi.verdict.verdict import Status
from swesbi.virtual.push_trains import record_train

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
COLUMNS: Final = ("change", "form", "status", "named", "near")
"""Of a row, which is a changed heart as recorded in one form."""
GATED, PUSHES = "gated", "pushes"
Change = Callable[[FloatArray, np.random.Generator], FloatArray]
Recorded = TypeVar("Recorded", Samples, pd.DataFrame)


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


class NonsenseQuestioner(Questioner):
    """Asks the network about hearts that are changed, or of which one value is."""

    def rows(self, number: int) -> Iterator[dict[str, object]]:
        """Yield a row a change and form of recording, of the heart of this number."""
        heart = self.settings.recorded(number, self.seed).heart
        own = sample_cycle(heart.curve.cycle_phase, heart.curve.stiffness_kpa[None], PHASE)[0]
        for name, change in CURVES.items():
            rng = generator(self.seed, NONSENSE_STREAM, name, number)
            changed = replace(heart, curve=TruthCurve(PHASE, change(own, rng)))
            samples = acquire(changed.curve, heart.context, self.settings.acquisition, rng)
            train = record_train(changed.curve, heart.context, rng)
            yield {"change": name, "form": GATED} | outcome(self.gated, changed, samples)
            yield {"change": name, "form": PUSHES} | outcome(self.pushes, changed, train)
        for wild in (SPIKE, SAMPLE):
            rng = generator(self.seed, NONSENSE_STREAM, wild, GATED, number)
            samples = acquire(heart.curve, heart.context, self.settings.acquisition, rng)
            spoilt = with_wild(samples, wild, rng)
            yield {"change": wild, "form": GATED} | outcome(self.gated, heart, spoilt, samples)
        rng = generator(self.seed, NONSENSE_STREAM, SPIKE, PUSHES, number)
        train = record_train(heart.curve, heart.context, rng)
        row = rng.choice(np.flatnonzero(train["status"] == STATUS_OK))
        wild_train = train.assign(**{SPEED: train[SPEED].where(train.index != row, WILD * train[SPEED])})
        yield {"change": SPIKE, "form": PUSHES} | outcome(self.pushes, heart, wild_train, train)

    def gated(self, heart: OtherHeart, samples: Samples) -> Answer:
        """Answer a gated recording of a heart."""
        settings = self.settings
        observation = ingest(samples, heart.context, settings.recording, settings.grid_points)
        return self._answered(recorded_as_answered(observation, samples, self.noise, settings))

    def pushes(self, heart: OtherHeart, train: pd.DataFrame) -> Answer:
        """Answer a push train of a heart."""
        return self._answered(recording_of_table(train, heart.context, DECLARED, self.settings))

    def _answered(self, recording: ModelledRecording) -> Answer:
        return answered(recording, self.knowledge, self.settings, self.seed)


def outcome(
    ask: Callable[[OtherHeart, Recorded], Answer],
    heart: OtherHeart,
    given: Recorded,
    clean: Recorded | None = None,
) -> dict[str, object]:
    """Return what is said of a recording, and what a wild value does where a clean recording is given too."""
    try:
        answer = ask(heart, given)
        without = None if clean is None else ask(heart, clean)
    except (RecordingError, NoLikelihoodError):
        return {"status": REFUSED}
    said: dict[str, object] = {"status": str(answer.verdict.status)}
    if without is None:
        return said
    named, near = _outliers(answer) > _outliers(without), _distance(answer, without) < NEAR_SD
    return said | {"named": int(named), "near": int(near)}


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
    draws = min(DRAWS, mcmc.least_draws)
    fewer = settings.exact.model_copy(update={"draws": draws, "max_rounds": ROUNDS, "mcmc": mcmc})
    return settings.model_copy(update={"exact": asking(fewer, EFFECTIVE_DRAWS)})


def nonsense_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Return a row a change and form: recordings by status, and of wild values those named and near."""
    said = (Status.NOT_CONTRADICTED, Status.UNINFORMATIVE, Status.DOUBTFUL, Status.CONTRADICTED)
    words = [*map(str, said), REFUSED]
    # NaN where nothing is wild
    grouped = rows.astype({"named": float, "near": float}).groupby(["change", "form"], sort=False)
    counts = grouped["status"].value_counts().unstack(fill_value=0).reindex(columns=words, fill_value=0)
    return counts.join(grouped[["named", "near"]].sum(min_count=1)).reset_index()
