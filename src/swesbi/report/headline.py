"""The outcome of the main experiment in a few lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from markupsafe import Markup

from swesbi.report.experiments import PAIRS, correlations
from swesbi.report.names import PARAMETERS
from swesbi.report.numbers import mean_sd, percent
from swesbi.report.recovery import level, nearest_level
from swesbi.report.results import Experiment, records


@dataclass(frozen=True)
class Fact:
    """One line: what it is about, and what came out."""

    name: str
    value: str


def headline(experiment: Experiment) -> tuple[Fact, ...]:
    """Return the facts that an abstract would give."""
    return tuple(_facts(experiment))


def caution(experiment: Experiment) -> Markup:
    """Return a warning where credible intervals cover less than they claim, else nothing.

    Judged by recordings with acquisition noise: the whole interval on the coverage lies below nominal.
    """
    table = experiment.recovery.acquisition
    nominal = nearest_level(table, experiment)
    rows = records(table[(table["nominal"] == nominal) & (table["ci_high"] < nominal)])
    if not rows:
        return Markup("")
    covered = [
        Markup("{} ({} %)").format(PARAMETERS[str(row["parameter"])], percent(row["coverage"]))
        for row in rows
    ]
    return Markup(
        "The {nominal} % credible intervals of this experiment cover the truth less often than they claim "
        "when recordings carry the noise of an acquisition: {covered}. They say what the observation model "
        "of the experiment implies, not how uncertain a measurement leaves the parameters."
    ).format(nominal=percent(nominal, 0), covered=Markup(", ").join(covered))


def _facts(experiment: Experiment) -> Iterator[Fact]:
    supports, scores = experiment.supports, experiment.supported
    yield Fact("Subjects that the prior supports", f"{len(scores)} of {len(supports)}")
    if len(scores):
        before, after = (mean_sd(scores[name].to_numpy(), 2) for name in ("rmse_prior_kpa", "rmse_kpa"))
        reduction = mean_sd(scores["rmse_reduction_percent"].to_numpy(), 1)
        yield Fact(
            "RMSE of the predictive median, prior → posterior",
            f"{before} → {after} kPa, reduced by {reduction} %",
        )
        band = f"{experiment.predictive_percent:g} % predictive band covers"
        grid, phases = (
            mean_sd(100.0 * scores[name].to_numpy(), 0) for name in ("coverage_grid", "coverage_phases")
        )
        yield Fact(f"The {band}", f"{grid} % of the observed curve, {phases} % of the measured phases")
        pairs = [_correlation(experiment, *pair) for pair in PAIRS]
        yield Fact("Posterior correlations", Markup("; ").join(pairs))
    for name, table in (("own", experiment.recovery.own), ("acquisition", experiment.recovery.acquisition)):
        nominal = percent(nearest_level(table, experiment), 0)
        covered = level(table, experiment)
        values = [Markup("{} {} %").format(PARAMETERS[key], percent(value)) for key, value in covered.items()]
        yield Fact(
            f"Recovery with {name} noise: {nominal} % intervals cover the truth in", Markup("; ").join(values)
        )


def _correlation(experiment: Experiment, one: str, other: str) -> Markup:
    value = mean_sd(correlations(experiment, one, other), 2)
    return Markup("{}, {}: {}").format(PARAMETERS[one], PARAMETERS[other], value)
