"""One person who is recorded twice: recorded, answered alone and together, and put into rows."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswersSettings, recorded_as_answered
from studies.validation.pairs import (
    VARIANTS,
    PairSource,
    RecordedVisit,
    Spreads,
    first_visit,
    second_visit,
    shared_truth,
)
from swesbi.answers.answer import inferred
from swesbi.answers.compared import both_visits, own_posterior
from swesbi.answers.knowledge import Knowledge
from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.persons.change.joint import Change, OwnPosterior, infer_change
from swesbi.persons.change.one_person import OnePerson, judge_one_person, shared_distance
from swesbi.persons.change.proposal import NormalVisit, normal_visit
from swesbi.persons.change.ratios import QUANTITIES
from swesbi.persons.change.settings import ChangeSettings
from swesbi.posterior.importance import NoLikelihoodError
from swesbi.posterior.space import normal_scores
from swesbi.prior import SomeParameters, bounds
from swesbi.recording.noise.cohort import read_noise
from swesbi.seeds import generator
from swesbi.study.finished import FinishedPopulation
from swesbi.verdict.verdict import Status
from swesbi.virtual.hearts.hearts import SimulatedHearts

Key = tuple[str, str, int]
"""Shares, variant and number of a pair."""
UNANSWERED = (NoLikelihoodError, RuntimeError, ValueError)
"""What leaves a pair without an answer: it is counted and named."""


@dataclass(frozen=True)
class Answered:
    """One recording with its own posterior; seconds of one core by part."""

    made: RecordedVisit
    model: SpeedModel
    own: OwnPosterior
    status: str
    seconds: Mapping[str, float]


@dataclass(frozen=True)
class Answerer:
    """What draws and answers pairs.

    Attributes:
        settings: Of hearts and of the answers to them; the name of the random streams is among these.
        spreads: From visit to visit.
        seed: The study's seed.
        changes: Of the answers to pairs, by name of the shares.
        finished: The network and what belongs to it.
        verdicts: Whether recordings are judged.
    """

    settings: HeartAnswersSettings
    spreads: Spreads
    seed: int
    changes: Mapping[str, ChangeSettings]
    finished: FinishedPopulation
    verdicts: bool

    def person(self, number: int, wanted: Sequence[Key]) -> Iterator[tuple[Key, pd.DataFrame]]:
        """Yield the rows of the pairs that are wanted of one person, whose first visit is answered once."""
        try:
            first = self._answered(lambda: first_visit(self.source, number))
        except UNANSWERED as error:
            yield from ((key, failed(key, error)) for key in wanted)
            return
        names = dict.fromkeys(variant for _, variant, _ in wanted)
        part = sum(first.seconds.values()) / len(names)
        for name in names:
            asked = [key for key in wanted if key[1] == name]
            for key, rows in self._variant(number, name, first, asked):
                yield key, rows.assign(cost_first_s=part)

    def _variant(
        self, number: int, name: str, first: Answered, wanted: Sequence[Key]
    ) -> Iterator[tuple[Key, pd.DataFrame]]:
        try:
            second = self._answered(lambda: second_visit(self.source, number, name, first.made))
        except UNANSWERED as error:
            yield from ((key, failed(key, error)) for key in wanted)
            return
        for key in wanted:
            try:
                yield key, self._pair(key, (first, second))
            except UNANSWERED as error:
                yield key, failed(key, error)

    def _answered(self, make: Callable[[], RecordedVisit]) -> Answered:
        """Record a heart, and infer it as a subject outside the study."""
        clock, settings = Clock(), self.settings
        made = make()
        clock.stop("cost_record_s")
        components, knowledge = read_noise(self.finished.noise).usual, knowledge_of(self.finished)
        recording = recorded_as_answered(made.observation, made.samples, components, settings)
        answered, efficiency = inferred(recording, knowledge, settings, self.seed)
        own = own_posterior(answered, knowledge.space(recording.model))
        clock.stop("cost_own_s")
        verdict = ""
        if self.verdicts:
            beats = recording.model.simulate(answered.phi)
            verdict = recording.judged(answered, beats, efficiency, knowledge, settings, self.seed).status
        clock.stop("cost_verdict_s")
        return Answered(made, recording.model, own, verdict, clock.seconds)

    def _pair(self, key: Key, visits: tuple[Answered, Answered]) -> pd.DataFrame:
        """Return the rows of a pair: one of each quantity, or of the test alone where they are strangers."""
        changes, clock = self.changes[key[0]], Clock()
        normal = [normal_visit(each.own.phi, self.model.prior, each.own.effective_draws) for each in visits]
        common = keyed(key) | {
            "failure": "",
            "not_contradicted": self._not_contradicted(visits),
            "true_distance_sd": self._true_distance(visits, normal, changes),
        }
        names = (f"{self.settings.stream} {key[2]}", *(each.model.recording.subject for each in visits))
        judge_or_infer = self._strangers if VARIANTS[key[1]].strangers else self._change
        found = [common | row for row in judge_or_infer(visits, normal, changes, names)]
        clock.stop("cost_joint_s")
        return pd.DataFrame(found).assign(**visits[1].seconds, **clock.seconds)

    def _strangers(
        self,
        visits: Sequence[Answered],
        normal: Sequence[NormalVisit],
        changes: ChangeSettings,
        names: Sequence[str],
    ) -> list[dict[str, object]]:
        """Make the test that both are of one person, which takes no joint posterior."""
        shares, rule = changes.shares.of(self.model.prior.names), changes.rule
        rng = generator(self.seed, "change", *names, "strangers")
        judged = judge_one_person(normal, shares, np.nan, rule.one_person_level, rule.null_draws, rng)
        return [of_test(judged)]

    def _change(
        self,
        visits: Sequence[Answered],
        normal: Sequence[NormalVisit],
        changes: ChangeSettings,
        names: Sequence[str],
    ) -> list[dict[str, object]]:
        """Infer both visits together, as a person's change is."""
        observed = [each.made.observation for each in visits]
        model = both_visits([each.model for each in visits], observed, changes)
        change = infer_change(model, [each.own for each in visits], changes, self.seed, *names)
        return [of_test(change.one_person) | row for row in of_change(change, visits)]

    @property
    def source(self) -> PairSource:
        """What pairs are drawn with; made here, since contexts are drawn by what goes to no other process.

        Raises:
            TypeError: The generator is one whose hearts are stored.
        """
        settings, hearts = self.settings, self.settings.source
        if not isinstance(hearts, SimulatedHearts):
            raise TypeError(f"hearts of {hearts.letter!r} are stored; visits need one that is simulated")
        return PairSource(
            hearts=hearts,
            spreads=self.spreads,
            population=settings.population,
            recording=settings.recording,
            grid_points=settings.grid_points,
            seed=self.seed,
            stream=settings.stream,
        )

    @property
    def model(self) -> SpeedModelSettings:
        """What recordings are inferred by."""
        return self.settings.exact_posterior.model

    def _not_contradicted(self, visits: Sequence[Answered]) -> str:
        if not self.verdicts:
            return ""
        return "yes" if all(Status(each.status).fits for each in visits) else "no"

    def _true_distance(
        self, visits: Sequence[Answered], normal: Sequence[NormalVisit], changes: ChangeSettings
    ) -> float:
        """Return how far apart the truths are in what is shared, in standard deviations of the posteriors."""
        names = self.model.prior.names
        tied = np.flatnonzero(changes.shares.of(names))
        prior = SomeParameters(tuple(self.model.prior.parameters[j] for j in tied))
        true = [shared_truth(each.made.truth, self.model.forward_model) for each in visits]
        # a heart without length dependence lies below the prior, at whose bound its score stays finite
        values = np.clip([[each[names[j]] for j in tied] for each in true], *bounds(prior))
        scores = normal_scores(values, prior)
        mean = np.zeros((len(visits), len(names)))
        mean[:, tied] = scores
        at = [replace(visit, mean=row) for visit, row in zip(normal, mean, strict=True)]
        return shared_distance(at, tied)


def keyed(key: Key) -> dict[str, object]:
    """Return what the row of a pair says of which it is."""
    return dict(zip(("shares", "variant", "number"), key, strict=True))


def of_test(pair: OnePerson) -> dict[str, object]:
    """Return what a row says of the test that both recordings are of one person."""
    return {
        "p_value_1": pair.p_value,
        "found_distance_sd": pair.distance,
        "log_bayes_factor_1": pair.log_bayes_factor,
    }


def of_change(change: Change, visits: Sequence[Answered]) -> Iterator[dict[str, object]]:
    """Yield what the rows of a pair say of each quantity.

    Attained stiffness counts as left alone where all of theta is, though loading moves it.
    """
    ratios, exact, apart = change.ratios, change.exact, true_log_ratio(visits)
    still = apart[:-1] == 0.0
    for j, quantity in enumerate(QUANTITIES):
        yield {
            "quantity": quantity,
            "true_log_ratio": apart[j],
            "left_alone": int([*still, still.all()][j]),
            "low_log": np.log(ratios.low[j]),
            "median_log": np.log(ratios.median[j]),
            "high_log": np.log(ratios.high[j]),
            "sd_log": ratios.sd_log[j],
            "risen_1": ratios.risen[j],
            "fallen_1": ratios.fallen[j],
            "narrowing_1": ratios.narrowing[j],
            "detectable_1": ratios.detectable[j],
            "sampler": exact.sampler,
            "converged": int(exact.converged),
            "k_hat_1": exact.k_hat,
            "efficiency_1": exact.efficiency,
            "first_efficiency_1": change.efficiency[0],
            "proposals": len(change.efficiency),
        }


def true_log_ratio(visits: Sequence[Answered]) -> FloatArray:
    """Return the true log ratio of each quantity, later to earlier; shape (4,)."""
    true = [np.log([*each.made.truth.volunteer.theta, each.made.shown_kpa]) for each in visits]
    return np.asarray(true[1] - true[0])


def failed(key: Key, error: Exception) -> pd.DataFrame:
    """Return the one row of a pair that could not be made or answered."""
    return pd.DataFrame([keyed(key) | {"failure": str(error)}])


class Clock:
    """Seconds of one core since the last stop, by part."""

    def __init__(self) -> None:
        """Start."""
        self.seconds: dict[str, float] = {}
        self._last = time.process_time()

    def stop(self, part: str) -> None:
        """Count what has passed to a part."""
        now = time.process_time()
        self.seconds[part], self._last = now - self._last, now


@lru_cache(maxsize=1)
def knowledge_of(finished: FinishedPopulation) -> Knowledge:
    """Read what answers all hearts, once a process."""
    return finished.knowledge()
