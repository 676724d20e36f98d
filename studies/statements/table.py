"""Tables of the judgements: scores, how firm each statement is, what each reading moves."""

from __future__ import annotations

from collections.abc import Mapping

import pandas as pd

from studies.statements.settings import OF_STUDY, READING, TRAINING
from swesbi.recording.settings import ACQUISITION_SEED
from swesbi.report.paper.values import DESIGNED, numbers


def scores_table(by_variant: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return a row a training and acquisition: statements that agree, those by design, of how many."""
    together = _trainings(by_variant)
    agrees = together["agrees"] == "yes"
    marked = together.assign(agree=agrees, designed=agrees & (together["origin"] == DESIGNED))
    grouped = marked.groupby(["training", "acquisition"], sort=False)
    return grouped.agg(
        agree=("agree", "sum"), designed=("designed", "sum"), of=("agree", "size")
    ).reset_index()


def stability_table(by_variant: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    """Return a row a statement: how often it agrees, and mean and range of its number over all judgements.

    A statement with several numbers, or with words, has no such number: its cells are empty.
    """
    together = _trainings(by_variant)
    together["value"] = [_number(text) for text in together["this_study"]]
    rows = []
    for statement, part in together.groupby("statement", sort=False):
        values = part["value"]
        told = values if values.notna().all() else values.iloc[:0]
        rows.append(
            {
                "statement": statement,
                "paper": part["paper"].iloc[0],
                "agrees": int((part["agrees"] == "yes").sum()),
                "of": len(part),
                "mean": told.mean(),
                "low": told.min(),
                "high": told.max(),
                "origin": part["origin"].iloc[0],
            }
        )
    return pd.DataFrame(rows)


def readings_table(by_variant: Mapping[str, pd.DataFrame], labels: Mapping[str, str]) -> pd.DataFrame:
    """Return a row a reading, the study's first: its score, and the statements that it gains and loses."""
    known = by_variant[OF_STUDY]
    study = known[known["acquisition"] == ACQUISITION_SEED].set_index("statement")
    rows = [_reading("as configured", study, study)]
    for name, label in labels.items():
        own = by_variant[f"{READING}{name}"].set_index("statement")
        rows.append(_reading(label, own, study))
    return pd.DataFrame(rows)


def _reading(label: str, own: pd.DataFrame, study: pd.DataFrame) -> dict[str, object]:
    agrees, before = own["agrees"] == "yes", study["agrees"] == "yes"
    moved = own["this_study"] != study["this_study"]
    return {
        "reading": label,
        "agree": int(agrees.sum()),
        "of": len(own),
        "gained": "; ".join(f"{name}: {own['this_study'][name]}" for name in own.index[agrees & ~before]),
        "lost": "; ".join(f"{name}: {own['this_study'][name]}" for name in own.index[~agrees & before]),
        "recovery_percent": ", ".join(_recoveries(own)),
        "moved": int(moved.sum()),
    }


def _recoveries(own: pd.DataFrame) -> list[str]:
    """Return the recoveries of k_0, k_ATP and k_SR, which readings of the test recordings move."""
    return [str(own["this_study"][name]) for name in own.index if str(name).startswith("recovery of ")]


def _trainings(by_variant: Mapping[str, pd.DataFrame]) -> pd.DataFrame:
    parts = [
        frame.assign(training=int(name.removeprefix(TRAINING)))
        for name, frame in by_variant.items()
        if name.startswith(TRAINING)
    ]
    return pd.concat(parts, ignore_index=True)


def _number(text: str) -> float:
    """Return the only number of a cell; NaN of words, and of several numbers."""
    return float("nan") if ";" in text or text[:1].isalpha() else numbers(text)[0]
