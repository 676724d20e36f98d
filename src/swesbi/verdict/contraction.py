"""What a recording has told: the posterior of each quantity beside its prior, on the logarithm.

A few speeds cannot tell four parameters. The ratio of standard deviations says which of them they narrow, and
a shift of the median which of them they move; of what neither narrows nor moves the answer is the prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.parameters import REPORTED, THETA
from swesbi.verdict.settings import UninformativeSettings
from swesbi.verdict.verdict import Status, Verdict, VerdictTest

CONTRACTION: Final = "contraction_"
"""Before a quantity: the name of its entry in ``verdict.json``."""
IN_WORDS: Final = {quantity.name: quantity.meaning for quantity in REPORTED} | {
    parameter.name: parameter.text for parameter in THETA
}


@dataclass(frozen=True)
class Contraction:
    """What a recording has told of one quantity: posterior over prior sd of its logarithm, and a shift.

    The shift is from the prior's median of the logarithm to the posterior's, over the prior's sd.
    """

    name: str
    sd_ratio: float
    shift: float
    uninformative: bool

    @property
    def in_words(self) -> str:
        """The quantity with its ratio: "k_ATP 0.98, uninformative"."""
        return f"{IN_WORDS[self.name]} {self.sd_ratio:.2f}{', uninformative' if self.uninformative else ''}"

    def test(self, limit: float) -> VerdictTest:
        """Return it as an entry of ``verdict.json``, which neither supports nor contradicts the model."""
        return VerdictTest(
            name=f"{CONTRACTION}{self.name}",
            statistic=self.sd_ratio,
            p_value=None,
            threshold=limit,
            flagged=False,
            detail=f"sd of the log is {self.sd_ratio:.2f} of the prior's, its median moved by "
            f"{self.shift:+.2f} of it{': uninformative' if self.uninformative else ''}",
        )


@dataclass(frozen=True)
class Contractions:
    """What a recording has told of each quantity, which may be as the prior has it from ``limit`` on."""

    of_each: tuple[Contraction, ...]
    limit: float

    @property
    def uninformative(self) -> bool:
        """Whether the recording leaves every quantity as the prior has it."""
        return all(one.uninformative for one in self.of_each)

    def beside(self, verdict: Verdict) -> Verdict:
        """Return a verdict with them; a recording that tells nothing, and fits, is uninformative."""
        status, sentence = verdict.status, verdict.sentence
        if self.uninformative and status == Status.NOT_CONTRADICTED:
            status = Status.UNINFORMATIVE
            sentence = f"{status}: the recording leaves every quantity as the prior has it"
        untold = (self.in_words,) if any(one.uninformative for one in self.of_each) else ()
        return replace(
            verdict,
            status=status,
            sentence=sentence,
            reasons=(*verdict.reasons, *untold),
            tests=(*verdict.tests, *(one.test(self.limit) for one in self.of_each)),
        )

    @property
    def in_words(self) -> str:
        """All of them in a line."""
        return f"posterior over prior sd of the log: {'; '.join(one.in_words for one in self.of_each)}"


def contractions(
    posterior: Mapping[str, FloatArray], prior: Mapping[str, FloatArray], settings: UninformativeSettings
) -> Contractions:
    """Compare draws of the posterior with draws of the prior, quantity by quantity.

    Draws without a logarithm are left out: a peak in diastole has an active share of zero.
    """
    of_each = tuple(_contraction(name, draws, prior[name], settings) for name, draws in posterior.items())
    return Contractions(of_each, settings.sd_ratio)


def _contraction(
    name: str, posterior: FloatArray, prior: FloatArray, settings: UninformativeSettings
) -> Contraction:
    after, before = (np.log(np.where(draws > 0.0, draws, np.nan)) for draws in (posterior, prior))
    sd = np.nanstd(before)
    ratio, shift = float(np.nanstd(after) / sd), float((np.nanmedian(after) - np.nanmedian(before)) / sd)
    as_before = ratio >= settings.sd_ratio and abs(shift) <= settings.shift
    return Contraction(name, ratio, shift, as_before)
