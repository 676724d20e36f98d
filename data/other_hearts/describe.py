"""Print the tables of README.md on the stored hearts: counts, and ranges of those of the validation."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `studies` is found

from studies.validation.hearts.recording import VALIDATION_STREAM
from studies.validation.hearts.stored import FILES, HeartsOfLetter, StoredHeart
from swesbi.base.arrays import FloatArray

FOLDER = Path(__file__).parent
WEAK = 0.35
OF_VALIDATION = ("e", "f")


def counts(letter: str, hearts: Sequence[StoredHeart]) -> Iterator[str]:
    """Yield a row of the table of refusals per stream."""
    for stream in dict.fromkeys(heart.stream for heart in hearts):
        of_stream = [heart for heart in hearts if heart.stream == stream]
        refused = [
            sum(getattr(heart, f"refused_{reason}") for heart in of_stream)
            for reason in ("failed", "implausible", "stiff")
        ]
        yield f"| {letter}, {stream} | {len(of_stream)} | " + " | ".join(map(str, refused)) + " |"


def ranges(hearts: Sequence[StoredHeart]) -> Iterator[str]:
    """Yield the rows of the table of beats, as medians with ranges, and how many hearts are weak."""
    beats = [heart.beat for heart in hearts]
    ejected = np.array([beat.ejection_fraction for beat in beats])
    listed = np.array([1.0 - heart.context.lvesv_ml / heart.context.lvedv_ml for heart in hearts])
    high, low = (
        np.array([getattr(beat.arterial_mmhg, end)() for beat in beats], dtype=np.float64)
        for end in ("max", "min")
    )
    active = np.array([beat.active_kpa.max() for beat in beats])
    at = np.array([beat.phase[int(beat.active_kpa.argmax())] for beat in beats])
    least, most = (np.array([getattr(beat.stretch, end)() for beat in beats]) for end in ("min", "max"))
    scale = np.array([heart.passive_scale_kpa for heart in hearts])
    yield f"| ejection fraction | {_range(ejected, 2)} |"
    yield f"| ejection fraction from the listed volumes | {_range(listed, 2)} |"
    yield f"| arterial pressure, mmHg | {_range(high, 0)} over {_range(low, 0)} |"
    yield f"| largest active stiffness, kPa | {_range(active, 0)}, at {_range(at, 2)} of the cycle |"
    yield f"| stretch | from {_range(least, 2)} to {_range(most, 2)} |"
    yield f"| a, kPa | {_range(scale, 1)} |"
    yield f"{int((ejected < WEAK).sum())} of the {len(hearts)} eject less than {100.0 * WEAK:.0f} %."


def _range(values: FloatArray, digits: int) -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in (np.median(values), values.min(), values.max()))
    return f"{middle} ({low} to {high})"


def main() -> None:
    """Print both files of the validation."""
    for letter in OF_VALIDATION:
        hearts = HeartsOfLetter.read(FOLDER / FILES[letter][0]).hearts
        print(*counts(letter, hearts), sep="\n")
        print(*ranges([heart for heart in hearts if heart.stream == VALIDATION_STREAM]), sep="\n")


if __name__ == "__main__":
    main()
