"""Power by the number of persons: many studies drawn from a bank, each analysed at common hyperparameters.

Persons of a study are drawn from the bank with replacement: the bank's persons stand for the population, also
where a study has more of them. What is known of the bank's chance variation is taken off
(``planning.chance``). How much is left the same studies of resampled banks say, each with its own chance
variation taken off (bootstrap): its variance is added to that of the number of studies. A bank without an
effect would by chance have one; it is made to have none: visits are alike there, so that each person counts a
second time with the visits the other way round, and of two groups both are drawn from the same persons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.base.arrays import BoolArray, FloatArray, below_each_other
from swesbi.base.progress import Progress
from swesbi.persons.cohort.model import thread_pools
from swesbi.persons.planning.bank import ARMS, EFFECT, NONE, Bank
from swesbi.persons.planning.chance import Chance
from swesbi.persons.planning.effect import Effect
from swesbi.persons.planning.hyperdraws import STREAM, Likelihoods
from swesbi.persons.planning.settings import PlannedStudiesSettings
from swesbi.seeds import generator

AT_ONCE: Final = 100
"""Studies whose weights are held in memory together."""
NINETY: Final = 1.645


@dataclass(frozen=True)
class StudyProbabilities:
    """What some studies of one size say, one each.

    Attributes:
        probability: Of an effect in the direction asked for; shape (s,).
        effective: Effective hyperdraws behind it; shape (s,).
    """

    probability: FloatArray
    effective: FloatArray


@dataclass(frozen=True)
class PowerCurve:
    """Power by number of persons, for one number of repeats; of each group where there are two.

    Attributes:
        repeats: Repeats at a phase.
        sizes: Numbers of persons; shape (k,).
        power: Share of studies that find the effect; shape (k,).
        power_se: Its Monte Carlo standard error, that of the bank included; shape (k,).
        false_positive: Share that find it where there is none; shape (k,).
        rough: Share with too few effective hyperdraws; shape (k,).
        needed: Persons for the power asked for, with those at the ends of its Monte Carlo interval; None
            where no number tried is enough.
    """

    repeats: int
    sizes: NDArray[np.int_]
    power: FloatArray
    power_se: FloatArray
    false_positive: FloatArray
    rough: FloatArray
    needed: tuple[int | None, int | None, int | None]

    def at(self, persons: int) -> tuple[float, float]:
        """Return power and false positives at a number of persons within those tried."""
        root, at = np.sqrt(self.sizes.astype(float)), np.sqrt(persons)
        return float(np.interp(at, root, self.power)), float(np.interp(at, root, self.false_positive))


def judge_studies(
    likelihoods: Likelihoods,
    counts: FloatArray,
    control: FloatArray,
    arm: str,
    effect: Effect,
    displacement: float = 0.0,
) -> StudyProbabilities:
    """Analyse studies.

    Args:
        likelihoods: Of the bank's persons.
        counts: How often each person of the bank is in each study, of those asked for; shape (N, s).
        control: Likewise of the control group; not read where there is none.
        arm: With the effect, or without.
        effect: In whose direction a study looks.
        displacement: By which the likelihoods of those asked for are moved along the log parameter.
    """
    log_effect, log_base = likelihoods.displaced(effect.number, displacement)
    side = log_effect > 0.0 if effect.rises else log_effect < 0.0
    parts: list[StudyProbabilities] = []
    for start in range(0, counts.shape[1], AT_ONCE):
        of = slice(start, start + AT_ONCE)
        with thread_pools().limit(limits=1):  # sums split over threads differ in the last bit
            log_weight = log_base[:, None] + likelihoods.changing[arm] @ counts[:, of]
            if likelihoods.control.shape[1]:
                log_weight += likelihoods.control @ control[:, of]
            parts.append(_judged(log_weight, side))
    return below_each_other(parts)


def _judged(log_weight: FloatArray, side: BoolArray) -> StudyProbabilities:
    """Return what weights (m, s), not normalised, say; they are changed."""
    log_weight -= log_weight.max(axis=0)
    weight = np.exp(log_weight, out=log_weight)
    weight /= weight.sum(axis=0)
    return StudyProbabilities(side.astype(float) @ weight, 1.0 / (weight**2).sum(axis=0))


def draw_counts(
    bank: NDArray[np.int_], persons: int, size: int, studies: int, rng: np.random.Generator
) -> FloatArray:
    """Draw studies of so many persons from a bank, with replacement; shape (persons, studies).

    Args:
        bank: Whom it holds, by their places; one may be there several times.
        persons: Places there are.
        size: Of a study.
        studies: How many.
        rng: Source.
    """
    chosen = bank[rng.integers(len(bank), size=(size, studies))]
    counts = np.zeros((persons, studies))
    np.add.at(counts, (chosen, np.arange(studies)), 1.0)
    return counts


def power_curve(
    likelihoods: Likelihoods,
    chance: Chance,
    effect: Effect,
    repeats: int,
    settings: PlannedStudiesSettings,
    rule: tuple[float, float],
    seed: int,
) -> PowerCurve:
    """Return power and false positives at every size, and the size for the power asked for.

    Args:
        likelihoods: Of the bank's persons.
        chance: Theirs.
        effect: To be found.
        repeats: Of the bank's recordings.
        settings: Sizes, studies.
        rule: Probability above which a study finds the effect, and the power asked for.
        seed: The study's seed.
    """
    probability, power = rule
    everyone, without = (np.arange(likelihoods.changing[arm].shape[1]) for arm in (EFFECT, NONE))
    moved = chance.displacement(everyone)
    rows = []
    progress = Progress(f"studies with {repeats} repeats", len(settings.sizes), unit="size")
    for size in settings.sizes:
        rng = [
            generator(seed, STREAM, "studies", repeats, size, what)
            for what in ("effect", "none", "bootstrap")
        ]
        found = _drawn(likelihoods, EFFECT, effect, size, settings.studies, everyone, rng[0], moved)
        none = _drawn(likelihoods, NONE, effect, size, settings.studies, without, rng[1])
        resampled = _resampled(likelihoods, chance, effect, size, settings, rng[2])
        called = found.probability > probability
        rows.append(
            (
                called.mean(),
                _error(called, resampled.probability > probability, settings.resamples),
                (none.probability > probability).mean(),
                (found.effective < settings.least_effective).mean(),
            )
        )
        progress.step()
    share, error, false, rough = np.array(rows).T
    sizes = np.array(settings.sizes)
    middle, fewest, most = (
        persons_for(power, sizes, share + side * NINETY * error) for side in (0.0, 1.0, -1.0)
    )
    return PowerCurve(repeats, sizes, share, error, false, rough, (middle, fewest, most))


def _drawn(
    likelihoods: Likelihoods,
    arm: str,
    effect: Effect,
    size: int,
    studies: int,
    bank: NDArray[np.int_],
    rng: np.random.Generator,
    displacement: float = 0.0,
) -> StudyProbabilities:
    """Draw studies of a bank's persons and analyse them; other arguments as of :func:`judge_studies`."""
    persons = likelihoods.changing[arm].shape[1]
    counts, control = (draw_counts(bank, persons, size, studies, rng) for _ in range(2))
    return judge_studies(likelihoods, counts, control, arm, effect, displacement)


def _resampled(
    likelihoods: Likelihoods,
    chance: Chance,
    effect: Effect,
    size: int,
    settings: PlannedStudiesSettings,
    rng: np.random.Generator,
) -> StudyProbabilities:
    """Analyse studies with the effect in equal parts, each of a bank drawn from the bank with replacement."""
    persons, each = len(chance.weight), max(1, settings.studies // settings.resamples)
    parts = []
    for _ in range(settings.resamples):
        bank = rng.integers(persons, size=persons)
        moved = chance.displacement(bank)
        parts.append(_drawn(likelihoods, EFFECT, effect, size, each, bank, rng, moved))
    return below_each_other(parts)


def _error(called: BoolArray, resampled: BoolArray, resamples: int) -> float:
    """Return the standard error of a share of studies, that of the bank they were drawn from included."""
    share = float(called.mean())
    of_studies = share * (1.0 - share) / len(called)
    parts = [part.mean() for part in np.array_split(resampled, resamples)]
    within = np.mean([part * (1.0 - part) for part in parts]) / (len(resampled) / resamples)
    of_bank = max(float(np.var(parts, ddof=1)) - float(within), 0.0)
    return float(np.sqrt(of_studies + of_bank))


def persons_for(power: float, sizes: Sequence[int] | NDArray[np.int_], found: FloatArray) -> int | None:
    """Return the least number of persons for a power; None where none of those tried has it.

    Power never falls with persons, so the shares found are made monotone, and taken linear in the root of the
    number between those tried.
    """
    from sklearn.isotonic import IsotonicRegression

    root = np.sqrt(np.asarray(sizes, dtype=float))
    rising = np.asarray(IsotonicRegression().fit_transform(root, np.clip(found, 0.0, 1.0)))
    if rising[-1] < power:
        return None
    least = int(np.argmax(rising >= power))
    if least == 0:
        return int(sizes[0])
    step = (power - rising[least - 1]) / (rising[least] - rising[least - 1])
    return int(np.ceil((root[least - 1] + step * (root[least] - root[least - 1])) ** 2 - 1e-9))


@dataclass(frozen=True)
class OnePersonPower:
    """The rule of `changes.rule` on the persons of a bank.

    Attributes:
        called: Share of those with the effect whose own change is called, in its direction.
        wrongly: Share of those without it of whom one is called, in any direction.
        detectable: Median over persons of the smallest change that can be detected, as a fraction.
        persons: Behind these.
    """

    called: float
    wrongly: float
    detectable: float
    persons: int


def one_person_power(bank: Bank, effect: Effect, probability: float) -> OnePersonPower | None:
    """Return what the protocol says of one person; None where persons came once.

    Args:
        bank: The persons.
        effect: What has happened to them.
        probability: Of a change beyond the threshold, above which one is called (``changes.rule``).
    """
    with_effect, without = ARMS.index(EFFECT), ARMS.index(NONE)
    if np.isnan(bank.risen).any():
        return None
    right = (bank.risen if effect.rises else bank.fallen)[with_effect, :, effect.number]
    either = np.maximum(bank.risen, bank.fallen)[without, :, effect.number]
    return OnePersonPower(
        called=float((right > probability).mean()),
        wrongly=float((either > probability).mean()),
        detectable=float(np.median(bank.detectable[with_effect, :, effect.number])),
        persons=len(bank.number),
    )
