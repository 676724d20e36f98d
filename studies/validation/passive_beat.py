r"""What a fixed passive stiffness, and physiology taken as known, do where the heart is not the model.

    python -m studies.validation.passive_beat --csv docs/tables/passive_beat.csv \
        --figure docs/figures/passive-beat.png

Generated subjects of a richer physiology than the model's, on which the discrepancy was chosen
(studies/discrepancy), are inferred three times by adaptive importance sampling, no network in between: with
the passive part along one reference beat of each subject, whatever theta is simulated; along the stretch of
each simulation's own beat; and along the own beat with the nuisance parameters free. The first two take
physiology and scale of the speeds as known, at the discrepancy that ``calibrated`` had while it did (2 % in
speed, 1.5 % of the cycle); the third is as configured. Prints for each how often the true parameters lie in
their credible intervals, the median log-width of these, the error in log and how it goes with the true
parameter, and the total log evidence. Takes minutes on one core.
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.discrepancy.evidence import Bank, fill_bank, score_pairs
from studies.discrepancy.settings import DiscrepancyStudySettings
from swesbi.base.arrays import FloatArray
from swesbi.base.progress import Progress
from swesbi.base.settings import Settings
from swesbi.config.read import read_merged
from swesbi.config.slices import fields_of
from swesbi.config.study import load_study
from swesbi.draws import normalised
from swesbi.measurement.likelihood import SpeedModelSettings, speed_model
from swesbi.measurement.settings import DiscrepancySettings, PassiveBeat
from swesbi.parameters import THETA_NAMES, THETA_SYMBOLS
from swesbi.prior import NuisanceSettings
from swesbi.recording.acquisition_settings import AcquisitionSettings
from swesbi.recording.settings import RecordingSettings
from swesbi.report.csv import write_csv
from swesbi.report.figures.style import TEXT_WIDTH_IN, new_figure, plain_decades, save_figure, style
from swesbi.report.numbers import as_percent
from swesbi.seeds import generator
from swesbi.virtual.generated import GeneratedSubject, generate_cohort

Name = Literal["reference", "own", "free"]
TITLES: Final[dict[Name, str]] = {
    "reference": "along one reference beat",
    "own": "along the own beat",
    "free": "own beat, physiology free",
}
"""What each inference is called, in the order shown."""
EXPERIMENT: Final = "calibrated"
EFFORT: Final = DiscrepancyStudySettings(
    subjects=50,
    speed_fractions=(0.02,),
    timing_cycles=(0.0,),
    simulations_per_round=2000,
    max_rounds=20,
    min_effective_draws=500,
    interval=0.9,
)
"""As much as the choice of the discrepancy takes, at the one pair that is in use."""
FORMER: Final = DiscrepancySettings(speed_fraction=0.02, timing_cycle=0.015)
HEIGHT_IN: Final = 2.6
SHOWN: Final = "k_sr_per_s"
SYMBOL: Final = THETA_SYMBOLS[THETA_NAMES.index(SHOWN)]
COVERED, MISSED = "#0072B2", "#D55E00"


class GeneratedSettings(Settings):
    """What the generated subjects and their posteriors depend on."""

    model: SpeedModelSettings
    acquisition: AcquisitionSettings
    recording: RecordingSettings
    study: DiscrepancyStudySettings


@dataclass(frozen=True)
class Estimate:
    """One parameter of one generated subject by one inference; the log evidence is that of the subject."""

    inference: str
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
    """Infer every subject in the three ways, print what it comes to, and write table and figure."""
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
    parser.add_argument("--csv", type=Path, help="table to write, a row an inference, subject and parameter")
    parser.add_argument("--figure", type=Path, help="figure to write, .png or .pdf")
    return parser.parse_args()


def study_settings(config: Path) -> tuple[GeneratedSettings, int]:
    """Return the settings of the experiment with an exact likelihood, and the study's seed."""
    study = load_study(read_merged(config))
    plain = fields_of(study, {"experiment": EXPERIMENT}, "model acquisition recording")
    return GeneratedSettings.from_plain(plain | {"study": EFFORT.to_plain()}), study.config.seed


def with_known_physiology(model: SpeedModelSettings) -> SpeedModelSettings:
    """Return the model with every nuisance parameter fixed at the value of the forward model's settings."""
    theta = model.prior.theta.model_copy(update={"nuisances": NuisanceSettings()})
    return model.model_copy(update={"prior": model.prior.model_copy(update={"theta": theta})})


def inferences(model: SpeedModelSettings) -> dict[Name, SpeedModelSettings]:
    """Return the models of the three inferences; the last is the one given."""
    known = with_known_physiology(model)

    def along(beat: PassiveBeat) -> SpeedModelSettings:
        return known.model_copy(update={"passive_beat": beat, "discrepancy": FORMER})

    return {"reference": along("reference"), "own": along("own"), "free": model}


def infer(settings: GeneratedSettings, subjects: int, seed: int) -> list[Estimate]:
    """Generate the cohort, and estimate every parameter of every subject by every inference."""
    model = settings.model
    cohort = generate_cohort(
        subjects,
        model.prior.theta,
        settings.acquisition,
        settings.recording,
        model.measurement.grid_points,
        seed,
    )
    models, estimates = inferences(model), list[Estimate]()
    progress = Progress("passive beat", len(cohort) * len(models), unit="posterior")
    for index, subject in enumerate(cohort):
        for name, under in models.items():
            rng = generator(seed, "passive beat", name, index)
            estimates += _of_subject(settings.study, subject, index, name, under, rng)
            progress.step()
    return estimates


def _of_subject(
    study: DiscrepancyStudySettings,
    subject: GeneratedSubject,
    index: int,
    inference: Name,
    model: SpeedModelSettings,
    rng: np.random.Generator,
) -> Iterator[Estimate]:
    sizes = (study.simulations_per_round, study.max_rounds, study.min_effective_draws)
    bank = fill_bank(speed_model(subject.recording, model), (model.discrepancy,), *sizes, rng)
    score = score_pairs(bank, subject.theta)[0]
    ends = _quantiles(bank, study.interval)
    for name, truth, (low, median, high) in zip(THETA_NAMES, subject.theta, ends, strict=True):
        numbers = (score.log_evidence, score.effective_draws)
        yield Estimate(inference, index, name, float(truth), low, median, high, *numbers)


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
    """Return a row an inference and parameter, as :func:`_summarised` has it."""
    rows = [
        {"inference": inference, "parameter": name} | _summarised(part)
        for (inference, name), part in frame.groupby(["inference", "parameter"], sort=False)
    ]
    return pd.DataFrame(rows)


def _summarised(part: pd.DataFrame) -> dict[str, float]:
    """Return coverage, median log-width, mean error in log, how it goes with the truth, log evidence.

    ``pull`` is the slope of the error over the truth, both in log: -1 where the estimate knows nothing of it.
    """
    error = np.log(part["median"] / part["truth"])
    slope = np.polyfit(np.log(part["truth"]), error, 1)[0]
    return {
        "n": len(part),
        "covered": int(part["covered"].sum()),
        "coverage": round(float(part["covered"].mean()), 3),
        "log_width": round(float(np.median(np.log(part["high"] / part["low"]))), 3),
        "bias_log": round(float(error.mean()), 3),
        "rms_error_log": round(float(np.sqrt((error**2).mean())), 3),
        "pull": round(float(slope), 3),
        "log_evidence": round(float(part["log_evidence"].sum()), 1),
        "least_effective_draws": round(float(part["effective_draws"].min())),
    }


def draw(frame: pd.DataFrame, interval: float) -> Figure:
    """Draw the error of k_SR over its truth, with the interval's, a panel an inference."""
    shown = frame[frame["parameter"] == SHOWN]
    with style():
        figure = new_figure(TEXT_WIDTH_IN, HEIGHT_IN)
        panels = figure.subplots(1, len(TITLES), sharex=True, sharey=True)
        for axes, (inference, title) in zip(panels, TITLES.items(), strict=True):
            part = shown[shown["inference"] == inference]
            _panel(axes, part)
            held = f"{int(part['covered'].sum())} of {len(part)} within {as_percent(interval)}"
            axes.set_title(f"{title}:\n{held}")
        panels[0].set_ylabel(f"inferred over true {SYMBOL}")
    return figure


def _panel(axes: Axes, part: pd.DataFrame) -> None:
    for held, color in ((True, COVERED), (False, MISSED)):
        rows = part[part["covered"] == int(held)]
        low, middle, high = (rows[name] / rows["truth"] for name in ("low", "median", "high"))
        axes.errorbar(
            rows["truth"], middle, [middle - low, high - middle], fmt="o", ms=2.5, lw=0.7, color=color
        )
    axes.axhline(1.0, color="0.6", lw=0.8, zorder=0)
    axes.set(xscale="log", yscale="log", xlabel=f"true {SYMBOL} (1/s)")
    for axis in (axes.xaxis, axes.yaxis):
        plain_decades(axis)


if __name__ == "__main__":
    main()
