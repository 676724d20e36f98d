"""Make the virtual trial anew: ``python data/virtual_trial/make.py [FOLDER]``.

README.md beside it says what it is.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[2]))  # the project's folder, where `data` is found

from data.makers.files import RECORDING, write_csv, write_recordings, write_text
from data.makers.tables import markdown, phase_medians
from swesbi.base.arrays import FloatArray
from swesbi.config.experiments import SpeedExperimentSettings
from swesbi.config.models import Config
from swesbi.config.read import at_configuration, in_words, parse_config, read_merged
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.parameters import NUISANCES, PEAK_ACTIVE, THETA
from swesbi.population.settings import of_group
from swesbi.prior import JointPriorSettings
from swesbi.recording.settings import ACQUISITION
from swesbi.study.parsers import add_options
from swesbi.virtual.trial import (
    AFTER,
    AT_SCALE_ONE,
    BEFORE,
    CONTROL,
    GROUPS,
    LOADING,
    MECHANICS,
    POPULATION,
    SPEED_SCALE,
    STREAM,
    TREATED,
    TRIAL,
    TrialPerson,
    TrialSettings,
    TrialSource,
    TrialVisit,
    draw_trial,
    narrowed,
)

ORIGIN: Final = "a virtual trial, simulated by swesbi.virtual.trial"
COLUMNS: Final = 6
COLOURS: Final = {BEFORE: "#0b3c6f", AFTER: "#d55e00"}
DIGITS: Final = "%.6g"
QUANTITIES: Final = {parameter.name: parameter.text for parameter in THETA} | {
    PEAK_ACTIVE.name: "peak active stiffness"
}
"""What is told of the drug, by the columns of the truth."""
TEXT: Final = """# A virtual trial

**These are not people, and there is no drug.** {number} virtual persons, {each} in each of two groups, are
recorded twice, `{before}` and `{after}`, {weeks} weeks apart. The {recordings} recordings have the file
format of real ones. In the group `{treated}` the second heart differs by a known effect, {effect}.
The trial tests the study's answers on change and on groups where the truth is known.

![The recordings](recordings.png)

| file | content |
|---|---|
| `subjects.csv` | context of each visit, with `person`, `visit` and `group` |
| `swe/<subject>.csv` | raw samples, one row per attempted push sample |
| `recording.yaml` | how the recordings were made |
| `truth.csv` | true theta, beat and nuisance parameters of each recording; no stage of inference reads it |

Regenerate all of it, byte for byte, with

```
python data/virtual_trial/make.py
```

Every number is drawn from the random stream `{stream}` of the study's seed, {seed}. Design and seed were
fixed before any recording was answered, and nothing was changed afterwards.

## Who they are

Contexts are drawn from the group `{group}` of the study's declared population (`population_experiments` in
`config/population.yaml`), with its shares of sex and age. True values of a heart:

| what | between persons | between the visits of one |
|---|---|---|
| {theta} | {share} of the spread of the study's prior | ± {theta_spread} each, and the effect |
| passive stiffness a | likewise | ± {scale_spread} |
| {loading} | the study's prior | ± {loading_spread} each |
| {scale} | {kept} of the variance of the study's prior | the rest |
| {kept_names} | the study's prior | none |
| heart rate | the population | ± {heart_rate_spread} |
| LVEDV, septal thickness, body surface area | the population | none |

All of it is chosen. Half of the prior's spread: a prior covers more than healthy hearts. 5 %: the change of a
heart from one day to another. Loading and heart rate vary as at rest. Spreads are standard deviations of
logarithms, normal and independent of each other. No visit leaves the prior's bounds. LVESV follows from LVEDV
and the beat of the visit, with a measurement error of {lvesv_error}. The mechanics are those of the
[virtual volunteers](../virtual_volunteers/README.md), richer than the inference model's: valve inertance,
wall inertia, finer steps.

Persons take part if their ejection fraction is {low} to {high} at the first visit, as in health (Lang et
al., J Am Soc Echocardiogr 28:1, 2015), and if both recordings are usable. {drawn} were drawn in all, of whom
{again} did not take part{reasons}.

## What the drug does

The factor on {effect_names} is the same for each treated person. The visits of each person differ besides.
Geometric means over the {each} of each group:

{effects}

Peak active stiffness is the largest active stiffness of the true beat. It depends on k_0, k_ATP, k_SR and the
loading of the day.

## How they are recorded

Protocol and noise are those of the virtual volunteers: {phases} gated phases, {repeats} sweeps of {samples}
spatial samples. Each speed has an error of {sample_error} of its own and one of {repeat_error} shared with
its repeat. A sweep has an error of {sweep_error} over all its phases. {failed} of the samples fail, and
{outliers} report a wrong wave.

## The persons

First visit, second visit:

{persons}
"""


def source_of(config: Config, trial: TrialSettings) -> TrialSource:
    """Return what the trial is drawn with: population of `amortised`, model of its base.

    A prior that fixes what the trial varies, and a population without such a group, are refused.
    """
    over_population = config.population_experiments[POPULATION]
    experiment = config.speed_experiments[over_population.base]
    prior = JointPriorSettings(
        theta=config.priors[experiment.prior], passive_stiffness_kpa=experiment.passive_stiffness_kpa
    )
    if fixed := [name for name in (*LOADING, SPEED_SCALE) if name not in prior.names]:
        raise ValueError(f"priors.{experiment.prior}.nuisances has no {fixed[0]}, which the trial varies")
    return TrialSource(
        trial=trial,
        population=of_group(over_population.population, trial.population_group),
        model=_model(config, experiment, narrowed(prior, trial.prior_share)),
        bounds=prior,
        acquisition=AT_SCALE_ONE,
        recording=config.recording,
        grid_points=config.measurement.grid_points,
        lvesv_fraction=experiment.misspecification.rule.volumes.lvesv_tolerance_fraction,
        seed=config.seed,
    )


def _model(
    config: Config, experiment: SpeedExperimentSettings, prior: JointPriorSettings
) -> SpeedModelSettings:
    return SpeedModelSettings(
        prior=prior,
        discrepancy=experiment.observation_model.discrepancy,
        forward_model=MECHANICS,
        measurement=config.measurement,
        density_kg_m3=config.recording.density_kg_m3,
    )


def subject_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return the rows of ``subjects.csv``: the context of each visit, and whose it is."""
    rows = [asdict(visit.context) | _whose(person, visit) for person in persons for visit in person.visits]
    return pd.DataFrame(rows).astype(object)


def truth_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return one row a recording: what is true of the heart at that visit, which nobody measures."""
    return pd.DataFrame([_truth_row(person, visit) for person in persons for visit in person.visits])


def _whose(person: TrialPerson, visit: TrialVisit) -> dict[str, str]:
    return {"person": person.name, "visit": visit.visit, "group": person.group}


def _truth_row(person: TrialPerson, visit: TrialVisit) -> dict[str, str | float]:
    theta = {name: visit.phi[name] for name in QUANTITIES if name in visit.phi}
    beat = {PEAK_ACTIVE.name: visit.peak_active_kpa, "ejection_fraction": visit.ejection_fraction}
    others = {name: value for name, value in visit.phi.items() if name not in theta}
    return {"subject": visit.context.subject, **_whose(person, visit), **theta, **beat, **others}


def log_ratios(truth: pd.DataFrame, quantity: str, group: str) -> FloatArray:
    """Return log(second visit / first) of each person of a group, shape (n,), from the table of truths."""
    own = truth.loc[truth["group"] == group, quantity].to_numpy(np.float64).reshape(-1, 2)
    return np.asarray(np.log(own[:, 1] / own[:, 0]))


def effect_table(truth: pd.DataFrame) -> pd.DataFrame:
    """Return, as texts, what truly changed: geometric mean of the ratios by group, and of both together."""
    rows = []
    for name, text in QUANTITIES.items():
        own = {group: log_ratios(truth, name, group) for group in GROUPS}
        shown = {f"{group}, second / first visit": _ratio(ratios) for group, ratios in own.items()}
        change = float(np.exp(own[TREATED].mean() - own[CONTROL].mean()))
        rows.append({"": text, **shown, "treated / control": f"{change:.3f}"})
    return pd.DataFrame(rows)


def _ratio(log_ratio: FloatArray) -> str:
    """Return the geometric mean with the spread of single persons about it."""
    return f"{np.exp(log_ratio.mean()):.3f} (single persons ± {100.0 * log_ratio.std(ddof=1):.0f} %)"


def person_table(persons: Sequence[TrialPerson]) -> pd.DataFrame:
    """Return the persons as texts: who they are, and theta and the peak active stiffness at both visits."""
    return pd.DataFrame([_person_row(person) for person in persons])


def _person_row(person: TrialPerson) -> dict[str, str]:
    first, second = person.visits
    values = {f"{text}{_unit(name)}": _both(person, name) for name, text in QUANTITIES.items()}
    return {
        "": person.name,
        "group": person.group,
        "sex, age": f"{first.context.sex}, {first.context.age_years:g}",
        "heart rate (1/min)": f"{first.context.hr_bpm:.0f}, {second.context.hr_bpm:.0f}",
        **values,
    }


def _unit(name: str) -> str:
    return next((f" ({parameter.unit})" for parameter in THETA if parameter.name == name), " (kPa)")


def _both(person: TrialPerson, name: str) -> str:
    values = [
        visit.peak_active_kpa if name == PEAK_ACTIVE.name else visit.phi[name] for visit in person.visits
    ]
    return ", ".join(f"{value:.1f}" for value in values)


def drawn_again(persons: Sequence[TrialPerson]) -> Counter[str]:
    """Return how many did not take part, by reason."""
    return Counter(reason for person in persons for reason in person.drawn_again)


def readme(persons: Sequence[TrialPerson], truth: pd.DataFrame, source: TrialSource) -> str:
    """Return the text of the README."""
    again = drawn_again(persons)
    counted = ", ".join(f"{reason} {count}" for reason, count in sorted(again.items()))
    return TEXT.format(
        **_design(source),
        number=len(persons),
        recordings=len(truth),
        drawn=len(persons) + again.total(),
        again=again.total() or "none",
        reasons=f" ({counted})" if counted else "",
        effects=markdown(effect_table(truth)),
        persons=markdown(person_table(persons)),
    )


def _design(source: TrialSource) -> dict[str, str]:
    trial, effect = source.trial, source.trial.effect
    texts = {parameter.name: parameter.text for parameter in (*THETA, *NUISANCES)}
    kept = [texts[name] for name in source.bounds.nuisance_names if name not in (*LOADING, SPEED_SCALE)]
    return _errors() | {
        "each": str(trial.persons_per_group),
        "before": BEFORE,
        "after": AFTER,
        "treated": TREATED,
        "weeks": f"{trial.weeks_between:g}",
        "effect": " and ".join(f"{texts[name]} times {factor:g}" for name, factor in effect.items()),
        "effect_names": " and ".join(texts[name] for name in effect),
        "stream": STREAM,
        "seed": str(source.seed),
        "group": trial.population_group,
        "theta": ", ".join(parameter.text for parameter in THETA),
        "share": f"{trial.prior_share:g}",
        "theta_spread": _percent(trial.theta_spread),
        "scale_spread": _percent(trial.passive_spread),
        "loading": ", ".join(texts[name] for name in LOADING),
        "loading_spread": _percent(trial.loading_spread),
        "scale": f"scale of all speeds, {texts[SPEED_SCALE]}",
        "kept": _percent(trial.kept_scale_share),
        "kept_names": ", ".join(kept),
        "heart_rate_spread": _percent(trial.heart_rate_spread),
        "lvesv_error": _percent(source.lvesv_fraction),
        "low": f"{trial.ejection_fraction[0]:g}",
        "high": f"{trial.ejection_fraction[1]:g}",
    }


def _errors() -> dict[str, str]:
    protocol = ACQUISITION
    return {
        "phases": str(protocol.phases),
        "repeats": str(protocol.repeats),
        "samples": str(protocol.samples_per_repeat),
        "sample_error": _percent(protocol.sample_sd_fraction),
        "repeat_error": _percent(protocol.repeat_sd_fraction),
        "sweep_error": _percent(protocol.sweep_fraction),
        "failed": _percent(protocol.failed_fraction),
        "outliers": _percent(protocol.outlier_fraction),
    }


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:g} %"


def draw_trial_recordings(persons: Sequence[TrialPerson]) -> Figure:
    """Draw the phase medians of both visits, a panel a person, the control group first."""
    ordered = sorted(persons, key=lambda person: (person.group != CONTROL, person.name))
    rows = -(-len(ordered) // COLUMNS)
    figure, axes = plt.subplots(
        rows, COLUMNS, figsize=(12.5, 0.6 + 1.7 * rows), sharex=True, sharey=True, layout="constrained"
    )
    for axis in axes.flat[len(ordered) :]:
        axis.set_axis_off()
    for axis, person in zip(axes.flat, ordered, strict=False):
        for visit in person.visits:
            phase, speed = phase_medians(visit.samples)
            axis.plot(phase, speed, "o-", ms=2.5, lw=1.2, color=COLOURS[visit.visit], label=visit.visit)
        axis.set_title(f"{person.name}, {person.group}", fontsize=9)
        axis.set(xlim=(0.0, 1.0))
        axis.tick_params(labelsize=8)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    for axis in axes[-1]:
        axis.set_xlabel("phase of the cycle", fontsize=9)
    for axis in axes[:, 0]:
        axis.set_ylabel("speed (m/s)", fontsize=9)
    figure.suptitle(
        "Recordings of the virtual trial: median shear-wave speed of each phase, from the R peak", fontsize=12
    )
    return figure


def write_trial(folder: Path, source: TrialSource) -> None:
    """Write contexts, recordings, truth, picture and README of the trial into ``folder``."""
    persons = draw_trial(source)
    truth = truth_table(persons)
    write_recordings(
        folder, {visit.context.subject: visit.samples for person in persons for visit in person.visits}
    )
    write_csv(folder / "subjects.csv", subject_table(persons))
    write_csv(folder / "truth.csv", truth, DIGITS)
    samples = ACQUISITION.samples_per_repeat
    made = RECORDING.format(origin=ORIGIN, seed=source.seed, samples=samples)
    write_text(folder / "recording.yaml", made)
    write_text(folder / "README.md", readme(persons, truth, source))
    with plt.style.context("default"):
        figure = draw_trial_recordings(persons)
        figure.savefig(folder / "recordings.png", dpi=100, metadata={"Software": None})
        plt.close(figure)


def main() -> None:
    """Write the virtual trial into a folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument(
        "folder", type=Path, nargs="?", default=Path(__file__).parent, help="default: that of this program"
    )
    add_options(parser)
    options = at_configuration(parser.parse_args())
    matplotlib.use("Agg")
    config = parse_config(
        read_merged(options.config, options.overlay), in_words(options.config, options.overlay)
    )
    write_trial(options.folder, source_of(config, TRIAL))


if __name__ == "__main__":
    main()
