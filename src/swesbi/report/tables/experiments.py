"""Tables of the experiments beside each other: recovery, settings, scores, training, the paper's numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, Final

import pandas as pd

from swesbi.parameters import THETA_NAMES
from swesbi.report.columns import ACQUIRED, DESIGN_MARK, named
from swesbi.report.numbers import MISSING, PARAMETERS, mean_sd, percent
from swesbi.report.paper.comparison import score_in_words
from swesbi.report.results import Experiment
from swesbi.report.table import Column, Table
from swesbi.report.tables.subjects import SCORES

_KINDS: Final = {False: "noise on features", True: "noise on the measured speeds"}


def recovery_table(experiments: Sequence[Experiment]) -> Table:
    """Return both recoveries side by side, at every nominal level."""
    frames = [
        each.recovery.merge(each.recovery_acquisition, on=["parameter", "nominal"], suffixes=("", ACQUIRED))
        .assign(experiment=each.name)
        .sort_values("nominal", kind="stable")
        for each in experiments
    ]
    own = ("coverage", "n", "coverage_acquired", "n_acquired", "bias", "bias_acquired", "contraction")
    return Table(
        "Recovery of known parameters, at every nominal level.",
        pd.concat(frames),
        named("experiment", "parameter", "unit", "nominal", *own),
        "Own noise: the experiment's observation model on the features. Acquisition noise: synthetic "
        "recordings, passed through quality control, passive calibration and inference like a measured one. "
        "Intervals are Clopper-Pearson intervals on the coverage. Bias, in the parameter's unit: mean of "
        "posterior mean minus truth. Contraction: 1 − mean posterior variance / prior variance.",
    )


def differences_table(experiments: Sequence[Experiment], main: Experiment) -> Table:
    """Return the settings in which each experiment differs from the main one.

    One of another kind, which has other settings altogether, differs in its kind.
    """
    reference = dict(_leaves(main.settings))
    rows: list[tuple[str, ...]] = []
    for experiment in experiments:
        if experiment.exact != main.exact:
            rows.append((experiment.name, "kind", _KINDS[main.exact], _KINDS[experiment.exact]))
            continue
        settings = dict(_leaves(experiment.settings))
        changed = [key for key in {**reference, **settings} if settings.get(key) != reference.get(key)]
        rows.extend(
            (experiment.name, key, _value(reference.get(key)), _value(settings.get(key))) for key in changed
        )
    return Table(
        f"What differs from the experiment {main.name}.",
        pd.DataFrame(rows, columns=["Experiment", "Setting", f"In {main.name}", "Here"]),
    )


def _leaves(plain: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield every setting by its dotted key."""
    for key, value in plain.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _value(value: object) -> str:
    if value is None:
        return MISSING
    return f"{value:g}" if isinstance(value, float) else json.dumps(value, ensure_ascii=False).strip('"')


def comparison_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return one column an experiment: support, scores, correlations, coverages."""
    frame = pd.DataFrame({each.name: dict(_measures(each)) for each in experiments})
    return Table(
        f"Experiments side by side ({cohort_title}).",
        frame.rename_axis("measure").reset_index(),
        named("measure", *(Column(each.name, each.name) for each in experiments)),
        "Each experiment's means are over the subjects that its own prior supports, so they may be over "
        "different subjects. Coverages by new observations have the noise of each experiment's own "
        "observation model. The prior's band and envelope are the ceiling of that by noiseless curves.",
    )


def _measures(experiment: Experiment) -> Iterator[tuple[str, str]]:
    names = [subject for subject, verdict in experiment.verdicts.items() if verdict.may_be_read]
    listed = f" ({', '.join(names)})" if names else ""
    yield "Subjects prior-supported", f"{len(names)} of {len(experiment.verdicts)}{listed}"
    for column in named(*SCORES):
        values, form = experiment.passed[str(column.source)], str(column.shown)
        yield column.heading, mean_sd(100.0 * values if "%" in form else values, int(form[0]))
    readable = experiment.posterior[experiment.posterior["may_be_read"]]
    for one, other in combinations(THETA_NAMES, 2):
        values = readable.loc[readable["parameter"] == one, f"correlation_{other}"]
        yield f"Correlation of {PARAMETERS[one]} and {PARAMETERS[other]}", mean_sd(values, 2)
    noises = {"": experiment.recovery, ", acquisition noise": experiment.recovery_acquisition}
    for noise, table in noises.items():
        for name, coverage in experiment.at_level(table)["coverage"].items():
            yield f"Recovery coverage of {PARAMETERS[str(name)]}{noise} (%)", percent(coverage)


def training_table(experiments: Sequence[Experiment]) -> Table:
    """Return how long each estimator was trained, and what it reached."""
    best = pd.concat(
        losses.assign(experiment=name, epochs=len(losses), last=losses["validation_loss"].iloc[-1]).nsmallest(
            1, "validation_loss"
        )
        for name, losses in ((each.name, each.training) for each in experiments)
    )
    return Table(
        "Training of the estimators.",
        best,
        named("experiment", "epochs", "epoch", "validation_loss", "training_loss", "last"),
        "Loss: mean of −log q(θ | z) over the rows of the pool.",
    )


def paper_table(comparison: pd.DataFrame, cohort_title: str) -> Table:
    """Return the comparison; numbers keep the digits that the table of the study gives them."""
    return Table(
        f"Every number of the paper, and of this study ({cohort_title}).",
        comparison,
        named("printed", "paper", "this_study", "note", "origin"),
        f"{DESIGN_MARK} Designed: a choice of this study, whose place stands in brackets, brought the value "
        "or its agreement with the paper about; it is no finding, however it is read.",
    )


def statements_table(statements: pd.DataFrame, cohort_title: str) -> Table:
    """Return the paper's statements on its results, and whether each agrees."""
    return Table(
        f"{score_in_words(statements)} ({cohort_title}).",
        statements,
        named("statement", "paper", "this_study", "agrees", "origin"),
        "A mean with a printed spread agrees within it, a share within the joint 95 % binomial interval, a "
        "coverage within one of 20 phases, an order, a count or a yes as printed. "
        f"{DESIGN_MARK} Designed: a choice of this study brought a number of the statement about.",
    )
