"""The README of the virtual trial, written from the same numbers as its files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import pandas as pd

from swesbi.parameters import NUISANCES, THETA
from swesbi.virtual_cohort.readme import markdown
from swesbi.virtual_cohort.settings import ACQUISITION
from swesbi.virtual_trial.persons import TrialPerson
from swesbi.virtual_trial.settings import AFTER, BEFORE, LOADING, SPEED_SCALE, STREAM, TREATED
from swesbi.virtual_trial.source import TrialSource
from swesbi.virtual_trial.tables import drawn_again, effect_table, person_table

TEXT: Final = """# A virtual trial

**These are not people, and there is no drug.** {number} virtual persons, {each} in each of two groups, are
recorded twice, `{before}` and `{after}`, {weeks} weeks apart: {recordings} recordings in the file format
that real ones would have. In the group `{treated}` the second heart differs by a known effect, {effect}.
The trial is there to show what the study's answers on change and on groups are worth where the truth is
known.

![The recordings](recordings.png)

| file | content |
|---|---|
| `subjects.csv` | context of each visit, with `person`, `visit` and `group` |
| `swe/<subject>.csv` | raw samples, one row per attempted push sample |
| `recording.yaml` | how the recordings were made |
| `truth.csv` | true theta, beat and nuisance parameters of each recording; no stage of inference reads it |

Regenerate all of it, byte for byte, with

```
python -m swesbi.virtual_trial data/virtual_trial
```

Every number is drawn from the stream `{stream}` of the study's seed, {seed}. Design and seed were fixed
before any recording was answered, and nothing was changed for what an answer said.

## Who they are

Contexts are drawn from the group `{group}` of the study's declared population (`population_experiments` in
`config.yaml`), in the shares of sex and age that it has. What is true of a heart:

| what | between persons | between the visits of one |
|---|---|---|
| {theta} | {share} of the spread of the study's prior | ± {theta_spread} each, and the effect |
| passive scale a | likewise | ± {scale_spread} |
| {loading} | the study's prior | ± {loading_spread} each |
| {scale} | {kept} of the variance of the study's prior | the rest |
| {kept_names} | the study's prior | none |
| heart rate | the population | ± {heart_rate_spread} |
| LVEDV, septal thickness, body surface area | the population | none |

All of it is chosen: half of the prior's spread, since a prior holds more than the healthy; 5 % as what a
heart differs by from one day to another; loading and heart rate as they vary at rest. Spreads are standard
deviations of logarithms, normal and independent of each other; no visit leaves the prior's bounds. LVESV is
what the beat of the visit leaves of LVEDV, measured with an error of {lvesv_error}. The mechanics are those
of the [virtual volunteers](../virtual_volunteers/README.md), richer than the inference model's: valve
inertance, wall inertia, finer steps.

Who takes part has an ejection fraction of {low} to {high} at the first visit, as in health (Lang et
al., J Am Soc Echocardiogr 28:1, 2015), and usable recordings at both. {drawn} were drawn in all, of whom
{again} did not take part{reasons}.

## What the drug does

The factor on {effect_names} of each treated person is the same; what is true of these persons besides is
what their visits differ by. Geometric means over the {each} of each group:

{effects}

Attained stiffness is the largest active stiffness of the true beat, which k_0, k_ATP and k_SR make together
with the loading of the day.

## How they are recorded

Protocol and noise are those of the virtual volunteers: {phases} gated phases, {repeats} sweeps of {samples}
spatial samples; each speed has an error of {sample_error} of its own and {repeat_error} shared with its
repeat, a sweep {sweep_error} over all its phases; {failed} of the samples fail, {outliers} report a wrong
wave.

## The persons

First visit, second visit:

{persons}
"""


def readme(persons: Sequence[TrialPerson], truth: pd.DataFrame, source: TrialSource) -> str:
    """Return the text of the README.

    Args:
        persons: Who took part.
        truth: The table of truths.
        source: What they were drawn with.
    """
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
        "scale_spread": _percent(trial.passive_scale_spread),
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
