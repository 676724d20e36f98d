r"""What does the model say of published values, and where do the virtual volunteers differ?

    python -m studies.validation.published --results results --csv studies/validation/tables/published.csv \
        --figure studies/validation/figures/published.png

Needs the exact posteriors of a finished study. A row a published value (``published_values.py``), and beside
it the 5, 50 and 95 % points of simulated hearts. They are draws of the prior of `calibrated` in healthy
contexts of the population, and draws of the virtual volunteers' posteriors, pooled. The last is the range of
the volunteers' truths. Hearts have the ages of the published ones, as far as there are such. A value agrees
where its interval overlaps the 5 to 95 % of the prior. Nothing is fitted: the comparison changes no prior.

Decay times run from the end of ejection until 1 / e of stiffness, or of pressure, is left. Slope and
correlation of the two are over hearts, one draw of each, and so there is one a draw. Takes a minute.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from studies.validation.published_figure import draw_published
from studies.validation.published_values import (
    CONTRACTION,
    DECAY_SLOPE,
    EJECTION,
    FILLING,
    FRACTION,
    HALF_RELAXATION,
    LATE_SHEAR,
    LATE_SPEED,
    LATE_YOUNG,
    OVER_HEARTS,
    PEAK_SPEED,
    PEAK_TIME,
    PUBLISHED,
    RATIO,
    Published,
    Quantity,
)
from swesbi.artefacts.csv import write_csv
from swesbi.base.arrays import FloatArray
from swesbi.config.read import read_merged
from swesbi.config.study import Study, load_study
from swesbi.config.view import View
from swesbi.context import Context
from swesbi.heart.intervals import systolic_intervals
from swesbi.heart.simulate import Beats
from swesbi.measurement.derived import LATE_DIASTOLE, curve_quantities
from swesbi.measurement.landmarks import Peak, find_peak, first_crossing_after
from swesbi.measurement.likelihood import SpeedModel, SpeedModelSettings
from swesbi.measurement.speeds import SpeedRecording
from swesbi.population.contexts import draw_contexts
from swesbi.population.settings import of_group
from swesbi.prior import sample
from swesbi.recording.speed import squared_speed_m2_s2
from swesbi.report.figures.style import save_figure
from swesbi.seeds import generator
from swesbi.study.results import Results
from swesbi.virtual.volunteers import VOLUNTEERS, Truth, simulate_truth

STREAM: Final = "published"
EXPERIMENT: Final = "calibrated"
POPULATION: Final = "amortised"
CONTEXTS: Final[Mapping[str, int]] = {"adults": 40, "children": 20}
"""How many contexts of each healthy group of the population."""
PRIOR_DRAWS: Final = 50
"""Of the prior, in each context."""
POSTERIOR_DRAWS: Final = 200
"""Of each volunteer's posterior."""
STIFFNESS_DECAY: Final = "stiffness_decay_ms"
PRESSURE_DECAY: Final = "pressure_decay_ms"
ATRIA_S: Final = 0.15
"""Before the R peak, in which the mitral flow is of the atria."""
LEVELS: Final = {"5": 0.05, "50": 0.5, "95": 0.95}


@dataclass(frozen=True)
class Simulated:
    """Quantities of simulated hearts: a row a heart and draw, with the columns of ``quantities_of_beats``.

    Attributes:
        prior: Of the prior.
        posterior: Of the posteriors of the virtual volunteers.
        truth: Of the volunteers themselves, one row each.
    """

    prior: pd.DataFrame
    posterior: pd.DataFrame
    truth: pd.DataFrame


def quantities_of_beats(
    beats: Beats, stiffness_kpa: FloatArray, context: Context, density_kg_m3: float
) -> pd.DataFrame:
    """Return the quantities of n beats, a row each; NaN where a beat failed.

    Args:
        beats: The beats.
        stiffness_kpa: Their total stiffness; shape (n, M).
        context: Whose beats they are.
        density_kg_m3: Density, for speeds sqrt(E / (3 rho)).
    """
    curve = curve_quantities(beats.cycle_phase, stiffness_kpa, context.period_s)
    late, peak = curve["late_diastole_kpa"], curve["peak_kpa"]
    peak_s = context.period_s * find_peak(beats.cycle_phase, stiffness_kpa).phase
    values = {
        LATE_SPEED.name: np.sqrt(squared_speed_m2_s2(late, density_kg_m3)),
        LATE_YOUNG.name: late,
        LATE_SHEAR.name: late / 3.0,
        PEAK_SPEED.name: np.sqrt(squared_speed_m2_s2(peak, density_kg_m3)),
        PEAK_TIME.name: np.where(np.isfinite(peak), 1e3 * peak_s, np.nan),
        RATIO.name: peak / late,
        HALF_RELAXATION.name: curve["half_relaxation_ms"],
        STIFFNESS_DECAY: decay_ms(beats, stiffness_kpa, context.period_s),
        PRESSURE_DECAY: decay_ms(beats, beats.ventricular_pressure_mmhg, context.period_s),
        **quantities_of_flows(beats, context.period_s),
    }
    who = {"subject": context.subject, "age_years": context.age_years, "draw": range(len(late))}
    return pd.DataFrame({**who, **values})


def quantities_of_flows(beats: Beats, period_s: float) -> dict[str, FloatArray]:
    """Return ejection, isovolumic contraction and filling of n beats, by name; NaN where one failed."""
    times = systolic_intervals(beats, period_s)
    of_atria = period_s * (1.0 - beats.cycle_phase) < ATRIA_S
    flow = beats.mitral_flow_ml_s
    early, late = flow[:, ~of_atria].max(axis=1), flow[:, of_atria].max(axis=1)
    return {
        EJECTION.name: 1e3 * times.ejection_s,
        CONTRACTION.name: 1e3 * times.isovolumic_contraction_s,
        FRACTION.name: beats.ejection_fraction,
        FILLING.name: np.divide(early, late, out=np.full_like(early, np.nan), where=late > 0.0),
    }


def decay_ms(beats: Beats, curves: FloatArray, period_s: float) -> FloatArray:
    """Return the time in ms from the end of ejection to 1 / e of what is left of curves (n, M) there; (n,).

    What is left is the height above the late-diastolic mean. Of a pressure this is tau of isovolumic
    relaxation. NaN where a beat failed or ejects nothing, or nothing is left.
    """
    phase, flows = beats.cycle_phase, beats.aortic_flow_ml_s > 0.0
    window = (phase >= LATE_DIASTOLE[0]) & (phase <= LATE_DIASTOLE[1])
    closure = len(phase) - 1 - np.argmax(flows[:, ::-1], axis=1)
    base, height = curves[:, window].mean(axis=1), curves[np.arange(len(curves)), closure]
    works = np.isfinite(curves).all(axis=1) & flows.any(axis=1) & (height > base)
    start = Peak(closure[works], phase[closure[works]], height[works])
    level = base[works] + (height - base)[works] / np.e
    found = np.full(len(curves), np.nan)
    found[works] = 1e3 * period_s * (first_crossing_after(phase, curves[works], start, level) - start.phase)
    return found


def quantities_of_draws(settings: SpeedModelSettings, context: Context, phi: FloatArray) -> pd.DataFrame:
    """Simulate phi (n, d) in a context, and return the beats' quantities, without the scale of speeds."""
    none = np.empty(0)
    model = SpeedModel(SpeedRecording(context, none, none, none, np.empty((0, 0))), settings)
    beats = model.simulate(phi)
    return quantities_of_beats(beats, np.add(*model.parts(phi, beats)), context, settings.density_kg_m3)


def prior_hearts(study: Study, settings: SpeedModelSettings) -> pd.DataFrame:
    """Return the quantities of draws of the prior, in contexts of the healthy groups of the population."""
    seed, population = study.config.seed, study.config.population_experiments[POPULATION].population
    frames = []
    for group, number in CONTEXTS.items():
        for context in draw_contexts(range(number), of_group(population, group), seed, STREAM, group):
            rng = generator(seed, STREAM, "prior", group, context.subject)
            drawn = quantities_of_draws(settings, context, sample(PRIOR_DRAWS, settings.prior, rng))
            frames.append(drawn.assign(subject=f"{group} {context.subject}"))
    return pd.concat(frames, ignore_index=True)


def posterior_hearts(study: Study, settings: SpeedModelSettings, results: Path) -> pd.DataFrame:
    """Return the quantities of draws of the volunteers' exact posteriors, each in its context.

    Raises:
        FileNotFoundError: A volunteer has no posterior there.
        ValueError: A posterior has other parameters than the model.
    """
    frames, parameters = [], len(settings.prior.names)
    for volunteer in VOLUNTEERS:
        subject = volunteer.context.subject
        phi = Results(results).of(EXPERIMENT, subject).posterior.phi
        if phi.shape[1] != parameters:
            raise ValueError(f"{subject}: {phi.shape[1]} parameters, but the model has {parameters}; rerun")
        rng = generator(study.config.seed, STREAM, "posterior", subject)
        rows = rng.choice(len(phi), min(POSTERIOR_DRAWS, len(phi)), replace=False)
        frames.append(quantities_of_draws(settings, study.cohort.rows[subject].to_context(), phi[rows]))
    return pd.concat(frames, ignore_index=True)


def true_hearts(truths: Iterable[Truth], density_kg_m3: float) -> pd.DataFrame:
    """Return the quantities of the volunteers' true beats, a row each."""
    frames = [
        quantities_of_beats(
            truth.beats, truth.curve.stiffness_kpa[None], truth.volunteer.context, density_kg_m3
        )
        for truth in truths
    ]
    return pd.concat(frames, ignore_index=True)


def values_of(hearts: pd.DataFrame, quantity: Quantity, ages: tuple[float, float]) -> FloatArray:
    """Return a quantity of the hearts within the ages, finite ones alone; of hearts together, one a draw."""
    inside = hearts[(hearts["age_years"] >= ages[0]) & (hearts["age_years"] < ages[1])]
    if quantity in OVER_HEARTS:
        values = [_over_hearts(draw, quantity) for _, draw in inside.groupby("draw")]
    else:
        values = inside[quantity.name].tolist()
    found = np.asarray(values, dtype=np.float64)
    return found[np.isfinite(found)]


def _over_hearts(draw: pd.DataFrame, quantity: Quantity) -> float:
    """Return slope or correlation of stiffness's decay on pressure's, over three hearts or more; else NaN."""
    decays = draw[[PRESSURE_DECAY, STIFFNESS_DECAY]].dropna().to_numpy()
    if len(decays) < 3:
        return float("nan")
    covariance = np.cov(decays.T)
    over = covariance[0, 0] if quantity == DECAY_SLOPE else np.sqrt(covariance[0, 0] * covariance[1, 1])
    return float(covariance[0, 1] / over)


def published_table(simulated: Simulated, published: Iterable[Published] = PUBLISHED) -> pd.DataFrame:
    """Return a row a published value: what was published, what the model says, and whether they overlap."""
    return pd.DataFrame([_row(value, simulated) for value in published])


def _row(value: Published, simulated: Simulated) -> dict[str, Any]:
    prior, posterior, truth = (
        values_of(hearts, value.quantity, value.ages)
        for hearts in (simulated.prior, simulated.posterior, simulated.truth)
    )
    prior_points, own = points(prior, "prior"), (truth.min(initial=np.inf), truth.max(initial=-np.inf))
    return {
        "quantity": value.quantity.name,
        "unit": value.quantity.unit,
        "source": value.source,
        "label": value.label,
        "hearts": value.hearts,
        "published_low": value.low,
        "published_mean": value.middle,
        "published_high": value.high,
        "published_interval": value.interval,
        "ages_from": value.ages[0],
        "ages_below": value.ages[1],
        **prior_points,
        **points(posterior, "posterior"),
        "volunteers_low": own[0] if len(truth) else np.nan,
        "volunteers_high": own[1] if len(truth) else np.nan,
        "agrees": said(overlap(value, (prior_points["prior_5"], prior_points["prior_95"])), len(prior)),
        "volunteers_agree": said(overlap(value, own), len(truth)),
        "compared": value.compared,
        "checked": value.checked,
    }


def points(values: FloatArray, name: str) -> dict[str, float]:
    """Return the 5, 50 and 95 % points of values (n,) by column; NaN of none."""
    return {
        f"{name}_{label}": float(np.quantile(values, level)) if len(values) else float("nan")
        for label, level in LEVELS.items()
    }


def overlap(value: Published, interval: tuple[float, float]) -> bool:
    """Tell whether the published interval and another share a point."""
    return bool(value.low <= interval[1] and interval[0] <= value.high)


def said(agrees: bool, values: int) -> str:
    """Return yes or no; nothing where there are not two values, which no interval is made of."""
    return ("yes" if agrees else "no") if values > 1 else ""


def main() -> None:
    """Simulate, print the table, and write table and figure."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of a finished study")
    parser.add_argument("--csv", type=Path, help="table to write, a row a published value")
    parser.add_argument("--figure", type=Path, help="figure to write, .png or .pdf")
    options = parser.parse_args()
    study = load_study(read_merged(options.config), str(options.config))
    plain = View(study, {"experiment": EXPERIMENT})["model"]
    settings = SpeedModelSettings.from_plain(plain)
    simulated = Simulated(
        prior_hearts(study, settings),
        posterior_hearts(study, settings, options.results),
        true_hearts(map(simulate_truth, VOLUNTEERS), settings.density_kg_m3),
    )
    table = published_table(simulated)
    print(table.round(3).to_string(index=False))
    if options.csv:
        write_csv(options.csv, table)
    if options.figure:
        save_figure(draw_published(table), options.figure)


if __name__ == "__main__":
    main()
