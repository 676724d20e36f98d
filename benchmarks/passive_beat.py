r"""Along whose stretch the passive stiffness runs: what it does to k_SR where the heart is not the model.

    python benchmarks/passive_beat.py --csv docs/tables/passive_beat.csv \
        --figure docs/figures/passive-beat.png

Generated subjects of a richer physiology than the model's, those of ``make discrepancy``, are inferred twice
by adaptive importance sampling, no network in between: with the passive part along one reference beat of each
subject, whatever theta is simulated, and along the stretch of each simulation's own beat. Prints for each
beat how often the true parameters lie in their credible intervals, the median log-width of these, the bias in
log, and the total log evidence. All else is as configured, the discrepancy too. Takes minutes on one core.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, get_args

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from swesbi.arrays import FloatArray
from swesbi.checks.discrepancy.cohort import GeneratedSubject, generate_cohort
from swesbi.checks.discrepancy.evidence import Bank, fill_bank, score_pairs
from swesbi.config.read import read_yaml
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study
from swesbi.draws import normalised
from swesbi.measurement.likelihood import speed_model
from swesbi.measurement.settings import PassiveBeat
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.progress import Progress
from swesbi.seeds import generator
from swesbi.show.csv import write_csv
from swesbi.show.figures.style import TEXT_WIDTH_IN, new_figure, plain_decades, save_figure, style
from swesbi.show.numbers import as_percent
from swesbi.study.stages.sensitivity import DiscrepancyStageSettings

BEATS: Final[tuple[PassiveBeat, ...]] = get_args(PassiveBeat)
TITLES: Final = {"reference": "along one reference beat", "own": "along each simulation's own beat"}
HEIGHT_IN: Final = 2.6
SHOWN: Final = "k_sr_per_s"
SYMBOL: Final = THETA_SYMBOLS[THETA_NAMES.index(SHOWN)]
COVERED, MISSED = "#0072B2", "#D55E00"


@dataclass(frozen=True)
class Estimate:
    """One parameter of one generated subject under one beat; the log evidence is that of the subject."""

    passive_beat: str
    subject: int
    parameter: str
    truth: float
    low: float
    median: float
    high: float
    log_evidence: float
    effective_draws: float

    @property
    def covered(self) -> bool:
        """Whether the interval holds the truth."""
        return self.low <= self.truth <= self.high


def main() -> None:
    """Infer every subject under both beats, print what it comes to, and write table and figure."""
    arguments = _arguments()
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    settings, seed = study_settings(arguments.config)
    estimates = infer(settings, arguments.subjects or settings.study.subjects, seed)
    frame = table(estimates)
    print(summary(frame).to_string(index=False))
    if arguments.csv:
        write_csv(arguments.csv, frame)
    if arguments.figure:
        save_figure(draw(frame, settings.study.interval), arguments.figure)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--config", type=Path, default=Path("config.yaml"))
    parser.add_argument("--subjects", type=int, help="how many; as configured, if not given")
    parser.add_argument("--csv", type=Path, help="table to write, a row a beat, subject and parameter")
    parser.add_argument("--figure", type=Path, help="figure to write, .png or .pdf")
    return parser.parse_args()


def study_settings(config: Path) -> tuple[DiscrepancyStageSettings, int]:
    """Return the settings of the study of the discrepancy, with the discrepancy that its experiment has."""
    study = load_study(read_yaml(config))
    settings = DiscrepancyStageSettings.from_plain(stage_settings(study, "discrepancy"))
    experiment = study.config.speed_experiments[study.config.discrepancy_study.experiment]
    chosen = {"discrepancy": experiment.observation_model.discrepancy}
    return settings.model_copy(update={"model": settings.model.model_copy(update=chosen)}), study.config.seed


def infer(settings: DiscrepancyStageSettings, subjects: int, seed: int) -> list[Estimate]:
    """Generate the cohort, and estimate every parameter of every subject under both beats."""
    model = settings.model
    cohort = generate_cohort(
        subjects,
        model.prior.theta,
        settings.acquisition,
        settings.recording,
        model.measurement.grid_points,
        seed,
    )
    progress, estimates = Progress("passive beat", len(cohort) * len(BEATS), unit="posterior"), []
    for index, subject in enumerate(cohort):
        for beat in BEATS:
            estimates += _of_subject(settings, subject, index, beat, seed)
            progress.step()
    return estimates


def _of_subject(
    settings: DiscrepancyStageSettings, subject: GeneratedSubject, index: int, beat: PassiveBeat, seed: int
) -> Iterator[Estimate]:
    study, under = settings.study, settings.model.model_copy(update={"passive_beat": beat})
    model, rng = speed_model(subject.recording, under), generator(seed, "passive beat", beat, index)
    sizes = (study.simulations_per_round, study.max_rounds, study.min_effective_draws)
    bank = fill_bank(model, (under.discrepancy,), *sizes, rng)
    score = score_pairs(bank, subject.theta)[0]
    ends = _quantiles(bank, study.interval)
    for name, truth, (low, median, high) in zip(THETA_NAMES, subject.theta, ends, strict=True):
        numbers = (score.log_evidence, score.effective_draws)
        yield Estimate(beat, index, name, float(truth), low, median, high, *numbers)


def _quantiles(bank: Bank, interval: float) -> FloatArray:
    """Return lower end, median and upper end of each parameter of theta, (3, 3), by the weights."""
    weight, tail = normalised(bank.log_weights()[0]), 0.5 * (1.0 - interval)
    rows = []
    for values in bank.phi[:, : len(THETA_NAMES)].T:
        order = np.argsort(values)
        rows.append(np.interp([tail, 0.5, 1.0 - tail], np.cumsum(weight[order]), values[order]))
    return np.array(rows)


def table(estimates: Sequence[Estimate]) -> pd.DataFrame:
    """Return a row an estimate, with 1 in ``covered`` where its interval holds the truth."""
    return pd.DataFrame([asdict(estimate) | {"covered": int(estimate.covered)} for estimate in estimates])


def summary(frame: pd.DataFrame) -> pd.DataFrame:
    """Return a row a beat and parameter: coverage, median log-width, bias in log, total log evidence."""
    rows = []
    for (beat, name), part in frame.groupby(["passive_beat", "parameter"], sort=False):
        rows.append(
            {
                "passive_beat": beat,
                "parameter": name,
                "n": len(part),
                "covered": int(part["covered"].sum()),
                "coverage": round(float(part["covered"].mean()), 3),
                "log_width": round(float(np.log(part["high"] / part["low"]).median()), 3),
                "bias_log": round(float(np.log(part["median"] / part["truth"]).mean()), 3),
                "log_evidence": round(float(part["log_evidence"].sum()), 1),
                "least_effective_draws": round(float(part["effective_draws"].min())),
            }
        )
    return pd.DataFrame(rows)


def draw(frame: pd.DataFrame, interval: float) -> Figure:
    """Draw the estimate of k_SR against its truth, with its interval, a panel a beat."""
    shown = frame[frame["parameter"] == SHOWN]
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        panels = figure.subplots(1, len(TITLES), sharex=True, sharey=True)
        for axes, (beat, title) in zip(panels, TITLES.items(), strict=True):
            part = shown[shown["passive_beat"] == beat]
            _panel(axes, part)
            held = f"{int(part['covered'].sum())} of {len(part)} in their {as_percent(interval)} interval"
            axes.set_title(f"{title}:\n{held}")
        panels[0].set_ylabel(f"inferred {SYMBOL} (1/s)")
    return figure


def _panel(axes: Axes, part: pd.DataFrame) -> None:
    for held, color in ((True, COVERED), (False, MISSED)):
        rows = part[part["covered"] == int(held)]
        middle = rows["median"].to_numpy()
        ends = np.stack([middle - rows["low"].to_numpy(), rows["high"].to_numpy() - middle])
        axes.errorbar(rows["truth"], middle, ends, fmt="o", ms=2.5, lw=0.7, color=color)
    values = part[["truth", "low", "high"]].to_numpy()
    limits = (0.95 * values.min(), 1.05 * values.max())
    axes.plot(limits, limits, color="0.6", lw=0.8, zorder=0)
    axes.set(xscale="log", yscale="log", xlabel=f"true {SYMBOL} (1/s)")
    for axis in (axes.xaxis, axes.yaxis):
        plain_decades(axis)


if __name__ == "__main__":
    main()
