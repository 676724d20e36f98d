"""Print what README.md beside it says of the stored hearts: counts, and ranges of those of the validation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.virtual.hearts.recorded import VALIDATION_STREAM
from swesbi.virtual.hearts.stored import FILES, StoredHeart, load_hearts

FOLDER = Path(__file__).parent
WEAK = 0.35


def counts(letter: str, hearts: Sequence[StoredHeart]) -> Iterator[str]:
    """Yield a row of the table of refusals a stream."""
    for stream in dict.fromkeys(heart.stream for heart in hearts):
        of_stream = [heart for heart in hearts if heart.stream == stream]
        refused = [
            sum(getattr(heart, f"refused_{reason}") for heart in of_stream)
            for reason in ("failed", "implausible", "stiff")
        ]
        yield f"| {letter}, {stream} | {len(of_stream)} | " + " | ".join(map(str, refused)) + " |"


def ranges(hearts: Sequence[StoredHeart]) -> str:
    """Say in a sentence or two what the beats are, as medians with ranges."""
    beats = [heart.beat for heart in hearts]
    ejected = np.array([beat.ejection_fraction for beat in beats])
    listed = np.array([1.0 - heart.context.lvesv_ml / heart.context.lvedv_ml for heart in hearts])
    high, low = (
        np.array([getattr(beat.arterial_mmhg, end)() for beat in beats], dtype=np.float64)
        for end in ("max", "min")
    )
    attained = np.array([beat.active_kpa.max() for beat in beats])
    at = np.array([beat.phase[int(beat.active_kpa.argmax())] for beat in beats])
    least, most = (np.array([getattr(beat.stretch, end)() for beat in beats]) for end in ("min", "max"))
    scale = np.array([heart.passive_scale_kpa for heart in hearts])
    return (
        f"ejection fraction {_range(ejected, 2)}, from the listed volumes {_range(listed, 2)}, arterial "
        f"pressure {_range(high, 0)} over {_range(low, 0)} mmHg, attained stiffness {_range(attained, 0)} "
        f"kPa at {_range(at, 2)} of the cycle, stretch from {_range(least, 2)} to {_range(most, 2)}, "
        f"a {_range(scale, 1)} kPa. {int((ejected < WEAK).sum())} of the {len(hearts)} eject less than "
        f"{100.0 * WEAK:.0f} %."
    )


def _range(values: FloatArray, digits: int) -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in (np.median(values), values.min(), values.max()))
    return f"{middle} ({low} to {high})"


def main() -> None:
    """Print both files."""
    for letter, (name, _) in FILES.items():
        hearts = load_hearts(FOLDER / name)[0]
        print(*counts(letter, hearts), sep="\n")
        print(ranges([heart for heart in hearts if heart.stream == VALIDATION_STREAM]))


if __name__ == "__main__":
    main()
