"""What has changed between two visits: ratios of the later to the earlier, and what a protocol can detect.

A quantity has changed where the posterior probability of log ratio > log(1 + t), or that of log ratio <
-log(1 + t), is above P, t and P being settings. Both directions together do not count: a posterior that is
wide enough lies beyond the threshold on either side, and tells no change. Where the posterior of the log
ratio is normal, N(m, s^2), the rule is |m| > log(1 + t) + z_P s. Recordings repeated at a true log ratio D
scatter m about it by s at most, so that a change is called with probability B or more from
D = log(1 + t) + (z_P + z_B) s on: exp(D) - 1 is the smallest detectable change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from scipy.special import ndtri

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels, median_and_interval
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import OF_THETA, PEAK_ACTIVE, THETA, THETA_NAMES
from swesbi.persons.change.settings import ChangeRuleSettings

QUANTITIES: Final = (*THETA_NAMES, PEAK_ACTIVE.name)
"""What is compared: theta, and the largest active stiffness that elastography shows of the beat."""
UNITS: Final = tuple(parameter.cf_unit for parameter in THETA) + ("kPa",)
WORDS: Final = (*(f"{each.meaning} {each.text}" for each in THETA), "peak active stiffness")
"""What sheets and figures call them."""


@dataclass(frozen=True)
class Ratios:
    """Ratios of the later visit to the earlier, by quantity in the order of ``QUANTITIES``; (4,) each."""

    median: Annotated[FloatArray, Variable("", "1", "posterior median of the ratio, later to earlier")]
    low: Annotated[FloatArray, Variable("", "1", "lower end of its credible interval")]
    high: Annotated[FloatArray, Variable("", "1", "upper end of its credible interval")]
    rise: Annotated[FloatArray, Variable("", "1", "probability of a ratio above 1")]
    risen: Annotated[FloatArray, Variable("", "1", "probability of a rise beyond the threshold")]
    fallen: Annotated[FloatArray, Variable("", "1", "probability of a fall beyond the threshold")]
    sd_log: Annotated[FloatArray, Variable("", "1", "posterior standard deviation of the log ratio")]
    detectable: Annotated[
        FloatArray, Variable("", "1", "smallest change that the protocol can detect, as a fraction")
    ]
    narrowing: Annotated[
        FloatArray,
        Variable(
            "", "1", "by how much the interval of the log ratio is narrower than by independent posteriors"
        ),
    ]

    @property
    def changed(self) -> FloatArray:
        """Probability of a change beyond the threshold, up or down; shape (4,)."""
        return self.risen + self.fallen

    @property
    def one_way(self) -> FloatArray:
        """Probability of a change beyond the threshold in its likelier direction; shape (4,)."""
        return np.maximum(self.risen, self.fallen)


def quantities_of(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return what ``QUANTITIES`` names of phi (n, d), by simulation; NaN where there is no beat; (n, 4)."""
    _, peak_active_kpa = model.parts(phi, model.simulate(phi))
    return np.column_stack([phi[:, OF_THETA], peak_active_kpa.max(axis=1)])


def log_ratios(values: Sequence[FloatArray]) -> FloatArray:
    """Return log later / earlier of the quantities (n, 4) of two visits, without draws that have no beat.

    Raises:
        ValueError: No draw has a beat at both visits.
    """
    ratio = np.log(values[1]) - np.log(values[0])
    known = np.isfinite(ratio).all(axis=1)
    if not known.any():
        raise ValueError("no draw of the posterior has a periodic beat at both visits; check the contexts")
    return np.asarray(ratio[known])


def summarise_ratios(
    joint: FloatArray, independent: FloatArray, mass: float, rule: ChangeRuleSettings
) -> Ratios:
    """Summarise draws of the log ratios.

    Args:
        joint: Draws of the joint posterior; shape (n, 4).
        independent: Draws of the visits' own posteriors, paired at random; shape (m, 4).
        mass: Of the credible interval.
        rule: When a change counts.
    """
    low, median, high = median_and_interval(joint, mass)
    beyond = np.log1p(rule.threshold)
    sd = joint.std(axis=0)
    alone = np.quantile(independent, interval_levels(mass), axis=0)
    return Ratios(
        median=np.exp(median),
        low=np.exp(low),
        high=np.exp(high),
        rise=(joint > 0.0).mean(axis=0),
        risen=(joint > beyond).mean(axis=0),
        fallen=(joint < -beyond).mean(axis=0),
        sd_log=sd,
        detectable=smallest_detectable(sd, rule),
        narrowing=1.0 - (high - low) / (alone[1] - alone[0]),
    )


def smallest_detectable(sd: FloatArray, rule: ChangeRuleSettings) -> FloatArray:
    """Return the smallest change, as a fraction, that is called one with the rule's power.

    Args:
        sd: Posterior standard deviations of log ratios; any shape.
        rule: Its threshold, probability and power.
    """
    reach = ndtri(rule.probability) + ndtri(rule.power)
    return np.asarray(np.expm1(np.log1p(rule.threshold) + reach * sd))
