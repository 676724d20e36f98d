"""Tables of the experiments beside each other: recovery, settings, scores, training, the paper's numbers."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, product
from typing import Any, Final

import pandas as pd

from swesbi.parameters import THETA_NAMES
from swesbi.report.numbers import (
    MISSING,
    PARAMETER_UNITS,
    PARAMETERS,
    mean_sd,
    percent,
    with_limits,
    with_minus,
)
from swesbi.report.paper.comparison import DESIGNED, score_in_words
from swesbi.report.results import Experiment, records
from swesbi.report.table import Column, Table, words
from swesbi.report.tables.subjects import ESTIMATE, PARAMETER, SCORES, SUBJECT, UNIT, parameters_of

_KINDS: Final = {False: "noise on features", True: "noise on the measured speeds"}
PAIRS: Final = tuple(combinations(THETA_NAMES, 2))
EXPERIMENT: Final = words("experiment", "Experiment")
COVERAGE: Final = ("coverage", "ci_low", "ci_high")
ACQUIRED: Final = "_acquired"
RECOVERY: Final = (
    EXPERIMENT,
    words("parameter", "Parameter", lambda name: f"{PARAMETERS[name]}, {PARAMETER_UNITS[name]}"),
    Column("nominal", "Nominal", "%", "0%"),
    Column(COVERAGE, "Coverage, own noise", "% (interval)", "1%"),
    Column("n", "Recordings", "", "d"),
    Column(
        tuple(f"{name}{ACQUIRED}" for name in COVERAGE), "Coverage, acquisition noise", "% (interval)", "1%"
    ),
    Column(f"n{ACQUIRED}", "Recordings", "", "d"),
    Column("bias", "Bias", "own noise", "2f"),
    Column(f"bias{ACQUIRED}", "Bias", "acquisition", "2f"),
    Column("contraction", "Contraction", "own noise", "3f"),
)
TRAINING: Final = (
    EXPERIMENT,
    Column("epochs", "Epochs trained", "", "d"),
    Column("epoch", "Epoch of the lowest validation loss", "", "d"),
    Column("validation_loss", "Lowest validation loss", "", "2f"),
    Column("training_loss", "Training loss there", "", "2f"),
    Column("last", "Validation loss at the end", "", "2f"),
)
MARK: Final = "†"


def recovery_table(experiments: Sequence[Experiment]) -> Table:
    """Return both recoveries side by side, at every nominal level."""
    frames = [
        experiment.recovery.own.merge(
            experiment.recovery.acquisition, on=["parameter", "nominal"], suffixes=("", ACQUIRED)
        )
        .assign(experiment=experiment.name)
        .sort_values("nominal", kind="stable")
        for experiment in experiments
    ]
    note = (
        "Own noise: the experiment's observation model on the features. Acquisition noise: synthetic "
        "recordings, passed through quality control, passive calibration and inference like a measured one. "
        "Intervals are Clopper-Pearson intervals on the coverage. Bias, in the parameter's unit: mean of "
        "posterior mean minus truth. Contraction: 1 − mean posterior variance / prior variance."
    )
    return Table("Recovery of known parameters, at every nominal level.", pd.concat(frames), RECOVERY, note)


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
    frame = pd.DataFrame(rows, columns=["Experiment", "Setting", f"In {main.name}", "Here"])
    return Table(f"What differs from the experiment {main.name}.", frame)


def comparison_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return one column an experiment: support, scores, correlations, coverages."""
    frame = pd.DataFrame({each.name: dict(_measures(each)) for each in experiments})
    measure = words("measure", "Mean ± sd over prior-supported subjects")
    note = (
        "Each experiment's means are over the subjects that its own prior supports, so they may be over "
        "different subjects."
    )
    return Table(
        f"Experiments side by side ({cohort_title}).",
        frame.rename_axis("measure").reset_index(),
        (measure, *(Column(each.name, each.name) for each in experiments)),
        note,
    )


def _measures(experiment: Experiment) -> Iterator[tuple[str, str]]:
    names = [subject for subject, verdict in experiment.verdicts.items() if verdict.may_be_read]
    named = f" ({', '.join(names)})" if names else ""
    yield "Subjects prior-supported", f"{len(names)} of {len(experiment.verdicts)}{named}"
    for column in SCORES:
        values, form = experiment.passed[str(column.source)], str(column.shown)
        yield column.heading, mean_sd(100.0 * values if "%" in form else values, int(form[0]))
    for one, other in PAIRS:
        label = f"Correlation of {PARAMETERS[one]} and {PARAMETERS[other]}"
        yield label, mean_sd(correlations(experiment, one, other), 2)
    for name, coverage in experiment.at_level(experiment.recovery.own)["coverage"].items():
        yield f"Recovery coverage of {PARAMETERS[str(name)]} (%)", percent(coverage)


def median_table(experiments: Sequence[Experiment], cohort_title: str) -> Table:
    """Return each subject's posterior medians with credible intervals, one column an experiment."""
    subjects = dict.fromkeys(name for each in experiments for name in each.verdicts)
    frame = pd.DataFrame(product(subjects, PARAMETERS), columns=["subject", "parameter"])
    for each in experiments:
        table = parameters_of(each.posterior)
        named = {name: f"{name} of {each.name}" for name in ESTIMATE}
        values = table.loc[table["may_be_read"], ["subject", "parameter", *ESTIMATE]].rename(columns=named)
        frame = frame.merge(values, how="left", on=["subject", "parameter"])
    columns = [
        Column(tuple(f"{name} of {each.name}" for name in ESTIMATE), each.name, "", with_limits)
        for each in experiments
    ]
    note = (
        "Median and credible interval; a dash where the experiment does not have the subject, or its prior "
        "does not support it."
    )
    caption = f"Posterior medians by experiment ({cohort_title})."
    return Table(caption, frame, (SUBJECT, PARAMETER, UNIT, *columns), note)


def correlations(experiment: Experiment, one: str, other: str) -> list[float]:
    """Return the posterior correlation of two parameters in every subject that may be interpreted."""
    table = experiment.posterior
    rows = table[(table["parameter"] == one) & table["may_be_read"]]
    return [float(value) for value in rows[f"correlation_{other}"]]


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


def training_table(experiments: Sequence[Experiment]) -> Table:
    """Return how long each estimator was trained, and what it reached."""
    rows = []
    for experiment in experiments:
        losses = experiment.training
        best = records(losses)[int(losses["validation_loss"].argmin())]
        last = losses["validation_loss"].iloc[-1]
        rows.append({**best, "experiment": experiment.name, "epochs": len(losses), "last": last})
    note = "Loss: mean of −log q(θ | z) over the rows of the pool."
    return Table("Training of the estimators.", pd.DataFrame(rows), TRAINING, note)


def paper_table(comparison: pd.DataFrame, cohort_title: str) -> Table:
    """Return the comparison; numbers keep the digits that the table of the study gives them."""
    columns = (
        words("quantity", "Quantity"),
        words("paper", "Paper", with_minus),
        words("this_study", "This study", with_minus),
        words("note", "Reading"),
        words("origin", "Designed or found", marked),
    )
    note = (
        f"{MARK} Designed: a choice of this study, whose place stands in brackets, brought the value or its "
        "agreement with the paper about; it is no finding, however it is read."
    )
    caption = f"Every number of the paper, and of this study ({cohort_title})."
    return Table(caption, comparison, columns, note)


def statements_table(statements: pd.DataFrame, cohort_title: str) -> Table:
    """Return the paper's statements on its results, and whether each agrees."""
    columns = (
        words("statement", "Statement"),
        words("paper", "Paper", with_minus),
        words("this_study", "This study", with_minus),
        words("agrees", "Agrees"),
        words("origin", "Designed or found", marked),
    )
    note = (
        "A mean with a printed spread agrees within it, a share within the joint 95 % binomial interval, a "
        "coverage within one of 20 phases, an order, a count or a yes as printed. "
        f"{MARK} Designed: a choice of this study brought a number of the statement about."
    )
    caption = f"{score_in_words(statements)} ({cohort_title})."
    return Table(caption, statements, columns, note)


def marked(origin: str) -> str:
    """Return where a number comes from, with a mark where it is designed."""
    return f"{MARK} {origin}" if origin.startswith(DESIGNED) else origin
