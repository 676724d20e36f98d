"""Natural waves of virtual volunteers between the eight: two closures a beat, and nothing else."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any, Final

import numpy as np
import pandas as pd

from swesbi.context import Context
from swesbi.heart.closures import valve_closures
from swesbi.recording.columns import EVENT, EVENTS, SPEED, STATUS_OK
from swesbi.recording.phases import sample_each
from swesbi.recording.speed import shear_wave_speed_m_s
from swesbi.seeds import generator
from swesbi.virtual_cohort.volunteers import OWN_PARAMETERS, VOLUNTEERS, Truth, Volunteer, forward_model_of

BETWEEN: Final = {
    "W1": ("A", "C"),
    "W2": ("A", "H"),
    "W3": ("C", "H"),
    "W4": ("B", "D"),
    "W5": ("B", "G"),
    "W6": ("D", "G"),
}
"""Of one sex, and with theta within the prior."""
BEATS: Final = 5
RR_JITTER: Final = 0.05  # relative standard deviation of the beats
LOST: Final = 0.2  # probability that a closure shows no wave
ERROR: Final = 0.1  # relative standard deviation of a speed
GUIDED: Final = 0.2  # sd of the log of what all waves of a closure share, as `natural_waves` of config.yaml
TOLD: Final = "natural_waves.csv"
"""What inference has told of them, written by ``benchmarks/natural_waves.py``."""
DENSITY_KG_M3: Final = 1000.0
DIGITS: Final = {"age_years": 0, "bsa_m2": 2, "hr_bpm": 0, "lvedv_ml": 0, "lvesv_ml": 0, "ivsd_cm": 2}


def wave_volunteers(seed: int) -> tuple[Volunteer, ...]:
    """Return the six volunteers, each from a stream of its own."""
    return tuple(_between(name, generator(seed, "between volunteers", name)) for name in BETWEEN)


def _between(name: str, rng: np.random.Generator) -> Volunteer:
    """Return a volunteer between two of the eight: every value of context, theta and physiology."""
    known = {volunteer.context.subject: volunteer for volunteer in VOLUNTEERS}
    first, second = (known[one] for one in BETWEEN[name])
    share = float(rng.uniform(0.2, 0.8))
    values = asdict(first.context) | {
        key: round(_mean(getattr(first.context, key), getattr(second.context, key), share), digits)
        for key, digits in DIGITS.items()
    }
    own: dict[str, Any] = {
        key: _short(_mean(getattr(first, key), getattr(second, key), share)) for key in OWN_PARAMETERS
    }
    theta = (_mean(*pair, share) for pair in zip(first.theta, second.theta, strict=True))
    return replace(
        first,
        context=Context(**values | {"subject": name}),
        theta=tuple(map(_short, theta)),
        **own,
        design=f"between {first.context.subject} and {second.context.subject}",
    )


def _mean(first: float, second: float, share: float) -> float:
    """Return the geometric mean of two values, the second with this share."""
    return float(first ** (1.0 - share) * second**share)


def _short(value: float) -> float:
    return float(f"{value:.3g}")


def natural_waves(truth: Truth, seed: int) -> pd.DataFrame:
    """Return the natural waves of a volunteer, a row a closure; each volunteer has a stream of its own.

    A speed is that of the wall at the closure of the volunteer's own beat, off by what all waves of the
    closure share and by an error of its own.
    """
    context = truth.volunteer.context
    rng = generator(seed, "natural waves", context.subject)
    closures = valve_closures(truth.beats, forward_model_of(truth.volunteer))
    stiffness = [
        sample_each(truth.curve.cycle_phase, truth.curve.stiffness_kpa[None], phase)[0]
        for phase in (closures.mitral, closures.aortic)
    ]
    lengths = np.round(1e3 * context.period_s * (1.0 + RR_JITTER * rng.standard_normal(BEATS)))
    shared = np.exp(GUIDED * rng.standard_normal(len(EVENTS)))
    speed = shear_wave_speed_m_s(np.array(stiffness), DENSITY_KG_M3) * shared
    measured = speed * np.exp(ERROR * rng.standard_normal((BEATS, len(EVENTS))))
    lost = rng.random(BEATS * len(EVENTS)) < LOST
    return pd.DataFrame(
        {
            EVENT: np.tile(EVENTS, BEATS),
            "rr_ms": np.repeat(lengths.astype(np.int64), len(EVENTS)),
            "beat": np.repeat(np.arange(BEATS), len(EVENTS)),
            SPEED: np.where(lost, np.nan, np.round(measured.ravel(), 3)),
            "status": np.where(lost, "no_wave", STATUS_OK),
        }
    )
