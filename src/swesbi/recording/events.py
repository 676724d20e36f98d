"""Rows of natural waves in a free-running recording: a valve that closes sets them off, once a beat.

They are placed where the model's own valve closes, so their time is not needed; where it is given, it is
looked at for whether a valve can close then.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from swesbi.arrays import BoolArray, FloatArray
from swesbi.recording.columns import EVENT, EVENTS, PUSH, TIME
from swesbi.recording.problems import Problem
from swesbi.recording.table import MISSING, TextTable, stood_before

CLOSES_MS: Final = {"mvc": (0.0, 150.0), "avc": (150.0, 600.0)}
"""When a valve can close, in ms since the R peak. The aortic one closes 546 - 2.1 HR ms after the onset of
QRS, with a standard deviation of 14 ms (Weissler et al., Circulation 1968;37:149): at 40 to 150 beats a
minute 460 to 230 ms; the mitral one with the first heart sound, tens of ms after it. With room on both
sides."""
VALVES: Final = {"mvc": "mitral", "avc": "aortic"}
WORDS: Final = f"write {', '.join(EVENTS)}; {PUSH}, or nothing, of a push"
A_TIME: Final = "give the time since the R peak of the push's beat in ms"
NUMBER_BEATS: Final = "add a column `beat` that numbers them from 0 or 1: a valve closes once in each"
ONE_EACH: Final = "keep one, or say by `repeat` which of several recordings it is from"
LEAVE_OUT: Final = "correct it, or leave it empty: a natural wave is placed where the model's valve closes"


def read_event(table: TextTable) -> NDArray[np.str_]:
    """Return what set off the wave of each row: push, mvc or avc; upper or lower case, a push where empty."""
    if EVENT not in table.cells:
        return np.full(len(table.rows), PUSH)
    words = np.array([word.strip().lower() or PUSH for word in table.cells[EVENT]])
    known = np.isin(words, (PUSH, *EVENTS))
    table.flag(EVENT, ~known, f"is none of {', '.join((PUSH, *EVENTS))}", WORDS)
    return words


def read_times_ms(table: TextTable, event: NDArray[np.str_]) -> FloatArray:
    """Return times since the R peak; a push needs one, of a natural wave it may be empty, NaN then."""
    push = event == PUSH
    if TIME not in table.cells:
        table.flag(EVENT, push, f"is a push, and the table has no {TIME}", A_TIME)
        return np.full(len(table.rows), np.nan)
    time = table.number(TIME, 0, 5000, A_TIME, may_be_empty=not push.all())
    if not push.all():
        table.flag(TIME, push & np.isin(table.cells[TIME], MISSING), "is no time of a push", A_TIME)
    for name, (low, high) in CLOSES_MS.items():
        wrong = (event == name) & ((time < low) | (time > high))
        reason = f"lies where no {VALVES[name]} valve closes ({low:g} to {high:g} ms since the R peak)"
        table.flag(TIME, wrong, reason, LEAVE_OUT)
    return time


def check_waves(table: TextTable, event: NDArray[np.str_]) -> None:
    """Note natural waves of beats without a number, and several of one kind in one beat."""
    wave: BoolArray = event != PUSH
    if not wave.any():
        return
    if "beat" not in table.cells:
        reason = "has natural waves, and does not say of which beats"
        table.problems.append(Problem(table.source, reason, NUMBER_BEATS, column="beat"))
        return
    names = [name for name in ("repeat", "beat") if name in table.cells]
    keys = [*(table.cells[name][wave] for name in names), event[wave]]
    repeated = np.zeros(len(event), dtype=np.bool_)
    repeated[wave] = stood_before(keys)
    table.flag(EVENT, repeated, f"repeats the {', '.join([*names, EVENT])} of an earlier row", ONE_EACH)


def in_words(event: NDArray[np.str_]) -> str:
    """Return how many natural waves of each kind there are: "mvc 4, avc 5"; empty if there are none."""
    counts = {name: int((event == name).sum()) for name in EVENTS}
    return ", ".join(f"{name} {count}" for name, count in counts.items() if count)
