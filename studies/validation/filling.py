"""Hearts with atria, walls and ramps that differ: where is k_SR right, and where is it not?

    python -m studies.validation.filling --csv studies/validation/tables/filling.csv

Counts the answers to the hearts of (p), README.md, which the study of the validation gives:
`snakemake -s studies/validation/Snakefile --configfile studies/validation/filling.yaml --cores 2`.
A row for all of them, and a row a third of what varies between them: how high atrial contraction is, when it
ends, how stiff the wall is, how long bonds take to form, and k_SR. Each has the shares in their intervals.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from studies.validation.answers import HeartAnswers
from studies.validation.score import HeartAnswer
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import BoolArray, FloatArray
from swesbi.parameters import PEAK_ACTIVE, THETA_NAMES
from swesbi.report.tables.validation_outcomes import QUANTITIES
from swesbi.virtual.hearts.generators import STORED
from swesbi.virtual.hearts.heart import K_SR
from swesbi.virtual.hearts.stored import FILES, HeartsOfLetter, StoredHeart

LETTER: Final = "p"
STREAM: Final = "filling"
ANSWERS: Final = Path("results/studies/validation") / STREAM / "answers" / LETTER
VARIED: Final = ("atrial_kick_pa", "atrial_end_s", "wall_stiffness", "creation_ramp_s")
RATE: Final = THETA_NAMES[K_SR]
THIRDS: Final = ("lower", "middle", "upper")


def filling_table(hearts: Mapping[int, StoredHeart], answers: Sequence[HeartAnswer]) -> pd.DataFrame:
    """Return a row for all hearts, and a row a third of what varies.

    Columns: of (what is in thirds), third, from and to (its values), hearts, k_sr_covered and shown_covered
    (shares in their intervals), not_contradicted, missed (of those not contradicted the share whose k_SR or
    peak active stiffness lies outside) and k_sr_log_width (the median of log high / low).

    Args:
        hearts: Of the letter, by number.
        answers: To each of them.
    """
    rows = [{"of": "all", "third": "", "from": np.nan, "to": np.nan} | _shares(answers)]
    for name, values in _varied([hearts[answer.number] for answer in answers]).items():
        for third, limits, chosen in _thirds(values):
            of_third = [answer for answer, there in zip(answers, chosen, strict=True) if there]
            place = {"of": name, "third": third, "from": limits[0], "to": limits[1]}
            rows.append(place | _shares(of_third))
    return pd.DataFrame(rows)


def _varied(hearts: Sequence[StoredHeart]) -> dict[str, FloatArray]:
    """Return what varies between hearts, a value each."""
    own = [dict(zip(heart.own_names, heart.own.tolist(), strict=True)) for heart in hearts]
    varied = {name: np.array([one[name] for one in own]) for name in VARIED}
    return varied | {RATE: np.array([heart.theta[K_SR] for heart in hearts])}


def _thirds(values: FloatArray) -> Iterator[tuple[str, tuple[float, float], BoolArray]]:
    """Yield each third of the values, as many in each: its name, its ends and who is in it."""
    for name, rows in zip(THIRDS, np.array_split(np.argsort(values, kind="stable"), 3), strict=True):
        chosen = np.zeros(len(values), dtype=bool)
        chosen[rows] = True
        yield name, (float(values[rows].min()), float(values[rows].max())), chosen


def _shares(answers: Sequence[HeartAnswer]) -> dict[str, object]:
    rate, shown = QUANTITIES.index(RATE), QUANTITIES.index(PEAK_ACTIVE.name)
    fits = [answer for answer in answers if answer.not_contradicted]
    widths = [np.log(answer.high[rate] / answer.low[rate]) for answer in answers if answer.asked[rate]]
    return {
        "hearts": len(answers),
        "k_sr_covered": _share([answer.covered[rate] for answer in answers]),
        "shown_covered": _share([answer.covered[shown] for answer in answers]),
        "not_contradicted": len(fits) / len(answers),
        "missed": _share([answer.missed for answer in fits]),
        "k_sr_log_width": float(np.median(widths)) if widths else np.nan,
    }


def _share(held: Sequence[bool]) -> float:
    return float(np.mean(held)) if len(held) else np.nan


def main(arguments: Sequence[str] | None = None) -> None:
    """Count the answers; print and write the table.

    Raises:
        ArtefactError: Hearts or answers are no such artefacts.
        SystemExit: There are no answers.
    """
    parser = argparse.ArgumentParser(prog="python -m studies.validation.filling", description=__doc__)
    parser.add_argument("--answers", type=Path, default=ANSWERS, help=f"their folder; default: {ANSWERS}")
    parser.add_argument("--csv", type=Path, help="where the table goes")
    options = parser.parse_args(arguments)
    files = sorted(options.answers.glob("*.h5"))
    answers = [answer for path in files for answer in HeartAnswers.read(path).of]
    if not answers:
        raise SystemExit(f"{options.answers}: holds no answers; answer the hearts first, see --help")
    stored = HeartsOfLetter.read(STORED / FILES[LETTER][0]).hearts
    table = filling_table({heart.number: heart for heart in stored if heart.stream == STREAM}, answers)
    print(table.to_string(index=False, float_format="%.3f"))
    if options.csv is not None:
        write_csv(options.csv, table)


if __name__ == "__main__":
    main()
