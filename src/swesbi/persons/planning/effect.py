"""What a planned study is to find, read from the words of the command line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from swesbi.parameters import THETA, THETA_NAMES
from swesbi.prior import PriorSettings

SHORT: Final = {"k0": "k0_kpa", "k_0": "k0_kpa", "k_atp": "k_atp_per_s", "k_sr": "k_sr_per_s"}
"""What parameters are called for short."""
LEAST_REPEATS: Final = 2


@dataclass(frozen=True)
class Effect:
    """A relative change of one parameter of ``THETA_NAMES``, as a fraction: -0.2 is a fall by 20 %."""

    parameter: str
    change: float

    @property
    def factor(self) -> float:
        """Later over earlier, or treated over control."""
        return 1.0 + self.change

    @property
    def number(self) -> int:
        """Column of the parameter in theta."""
        return THETA_NAMES.index(self.parameter)

    @property
    def words(self) -> str:
        """For text: 'k_SR -20 %'."""
        return f"{THETA[self.number].text} {100.0 * self.change:+g} %"

    @property
    def slug(self) -> str:
        """For names of files."""
        return f"{self.parameter}{100.0 * self.change:+g}"


def parse_percent(text: str, key: str) -> float:
    """Read '3%' or '0.03' as the fraction 0.03; ``key`` is named where it is neither."""
    match = re.fullmatch(r"\s*([+-]?\d+(?:\.\d+)?)\s*(%?)\s*", text)
    if match is None:
        raise ValueError(f"{key} = {text!r}: expected a percentage such as 20%, or a fraction such as 0.2")
    return float(match[1]) / (100.0 if match[2] else 1.0)


def parse_effect(text: str) -> Effect:
    """Read 'k_sr=-20%'; refuse no change, and one that leaves nothing."""
    name, equals, value = text.partition("=")
    known = {each.lower(): SHORT.get(each, each) for each in (*SHORT, *THETA_NAMES)}
    if not equals:
        raise ValueError(f"--effect {text!r}: expected a parameter and its change, k_sr=-20%")
    if name.strip().lower() not in known:
        raise ValueError(f"--effect {text!r}: {name.strip()!r} is no parameter; those are k0, k_atp, k_sr")
    change = parse_percent(value, f"--effect {name.strip()}")
    if change == 0.0:
        raise ValueError(f"--effect {text!r}: a change of 0 is no effect; name one to be found")
    if change <= -1.0:
        raise ValueError(f"--effect {text!r}: a fall by {-change:.0%} leaves nothing; name one above -100%")
    return Effect(known[name.strip().lower()], change)


def check_effect(effect: Effect, prior: PriorSettings) -> None:
    """Refuse an effect after which the middle person lies outside the prior."""
    one = prior.parameters[effect.number]
    after = one.centre * effect.factor
    if not one.low < after < one.high:
        raise ValueError(
            f"--effect {effect.words}: takes {effect.parameter} of the middle person from {one.centre:g} to "
            f"{after:g}, outside the prior's bounds {one.low:g} to {one.high:g}; name a smaller one"
        )


def parse_repeats(text: str, least: int) -> tuple[int, ...]:
    """Read '3' or '3,5,8'; with fewer than ``least`` quality control refuses a recording."""
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise ValueError(f"--repeats {text!r}: expected a number of repeats, or several: 3,5,8")
    numbers = tuple(dict.fromkeys(int(part) for part in parts))
    if small := [number for number in numbers if number < max(least, LEAST_REPEATS)]:
        raise ValueError(
            f"--repeats {text!r}: {small[0]} cannot be answered, since quality control needs "
            f"{max(least, LEAST_REPEATS)} repeats at a phase to tell a standard error; give more"
        )
    return numbers


def log_factor(effect: Effect) -> float:
    """Return the effect on the scale of logarithms."""
    return float(np.log(effect.factor))
