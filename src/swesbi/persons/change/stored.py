"""What has changed between two visits, by ratios of the later to the earlier: as kept, tabled and told.

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
import pandas as pd
from numpy.typing import NDArray
from scipy.special import ndtri

from swesbi.artefacts import Artefact, Labels, Part, Variable
from swesbi.base.arrays import FloatArray
from swesbi.draws import interval_levels, median_and_interval
from swesbi.measurement.likelihood import SpeedModel
from swesbi.parameters import NUISANCES, OF_THETA, PEAK_ACTIVE, THETA, THETA_NAMES
from swesbi.persons.cohort.stored import CohortPosterior
from swesbi.persons.settings import ChangeRuleSettings

QUANTITIES: Final = (*THETA_NAMES, PEAK_ACTIVE.name)
"""What is compared: theta, and the largest active stiffness that elastography shows of the beat."""
UNITS: Final = tuple(parameter.cf_unit for parameter in THETA) + ("kPa",)
WORDS: Final = (*(f"{each.meaning} {each.text}" for each in THETA), "peak active stiffness")
"""What sheets and figures call them."""
SEPARATOR: Final = "; "
VISIT: Final = "visit"
WIDTH: Final = 32
OF_QUANTITY: Final = dict(zip(QUANTITIES, WORDS, strict=True))
OF_NUISANCE: Final = {parameter.name: parameter.meaning for parameter in NUISANCES}


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

    Raises ValueError where no draw has a beat at both visits.
    """
    ratio = np.log(values[1]) - np.log(values[0])
    known = np.isfinite(ratio).all(axis=1)
    if not known.any():
        raise ValueError("no draw of the posterior has a periodic beat at both visits; check the contexts")
    return np.asarray(ratio[known])


def summarise_ratios(
    joint: FloatArray, independent: FloatArray, mass: float, rule: ChangeRuleSettings
) -> Ratios:
    """Summarise draws of the log ratios: joint ones (n, 4), beside visits paired at random (m, 4)."""
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

    ``sd`` are posterior standard deviations of log ratios.
    """
    reach = ndtri(rule.probability) + ndtri(rule.power)
    return np.asarray(np.expm1(np.log1p(rule.threshold) + reach * sd))


@dataclass(frozen=True)
class OnePerson:
    """Whether two recordings can be of one person."""

    log_bayes_factor: Annotated[float, Variable("", "1", "log Bayes factor of one person against two")]
    log_ratio: Annotated[float, Variable("", "1", "its normal approximation, the statistic of the test")]
    p_value: Annotated[float, Variable("", "1", "share of pairs of one person with as small a statistic")]
    level: Annotated[float, Variable("", "1", "of the test that both recordings are of one person")]
    distance: Annotated[
        float, Variable("", "1", "distance in shared parameters, in posterior standard deviations")
    ]

    @property
    def flagged(self) -> bool:
        """Whether the pair is taken for two persons."""
        return self.p_value <= self.level


@dataclass(frozen=True)
class StoredChange(Artefact, kind="change"):
    """The change of a person between two visits, the earlier first."""

    visit: Annotated[tuple[str, ...], Labels(VISIT)]
    quantity: Annotated[tuple[str, ...], Labels("quantity")]
    parameter: Annotated[tuple[str, ...], Labels("joint_parameter")]
    share: Annotated[tuple[str, ...], Labels("share")]
    person: Annotated[str, Variable("", "1", "the person")]
    subject: Annotated[NDArray[np.str_], Variable(VISIT, "1", "recording of the visit")]
    verdict: Annotated[NDArray[np.str_], Variable(VISIT, "1", "verdict of the recording by itself")]
    phi: Annotated[
        FloatArray, Variable("visit draw joint_parameter", "as named", "draws of the joint posterior")
    ]
    quantities: Annotated[
        FloatArray, Variable("visit draw quantity", "as named", "what is compared; NaN without a beat")
    ]
    shares: Annotated[FloatArray, Variable("share", "1", "what visits share, as configured")]
    ratios: Annotated[Ratios, Part("ratio_{}", "quantity")]
    one_person: Annotated[OnePerson, Part()]
    sampler: Annotated[str, Variable("", "1", "what gave the draws: importance or mcmc")]
    converged: Annotated[bool, Variable("", "1", "1 where weights or sampler are reliable, else 0")]
    reasons: Annotated[str, Variable("", "1", "why the weights were not used, what the sampler missed")]
    k_hat: Annotated[float, Variable("", "1", "Pareto shape of the importance weights")]
    k_hat_limit: Annotated[float, Variable("", "1", "largest Pareto shape of reliable weights")]
    efficiency: Annotated[float, Variable("", "1", "effective share of the weighted draws")]
    weighted_draws: Annotated[int, Variable("", "1", "weighted draws")]
    log_evidence: Annotated[float, Variable("", "1", "log evidence of both recordings")]
    log_evidence_se: Annotated[float, Variable("", "1", "its Monte Carlo standard error")]
    interval_mass: Annotated[float, Variable("", "1", "mass of the credible intervals")]
    threshold: Annotated[float, Variable("", "1", "change that counts, as a fraction")]
    probability: Annotated[
        float, Variable("", "1", "probability in one direction above which a quantity has changed")
    ]

    @property
    def changed(self) -> tuple[str, ...]:
        """Names of the quantities that have changed by more than the threshold, by the rule."""
        return tuple(
            name for name, p in zip(self.quantity, self.ratios.one_way, strict=True) if p > self.probability
        )


def change_table(change: StoredChange) -> pd.DataFrame:
    """Return the rows of ``change.csv``, one a quantity; the name of each column ends in its unit."""
    ratios, pair = change.ratios, change.one_person
    both = np.nanmedian(change.quantities, axis=1)
    return pd.DataFrame(
        {
            "person": change.person,
            "from_visit": change.visit[0],
            "to_visit": change.visit[1],
            "quantity": change.quantity,
            "unit": UNITS,
            "from_median": both[0],
            "to_median": both[1],
            "ratio_median_1": ratios.median,
            "ratio_low_1": ratios.low,
            "ratio_high_1": ratios.high,
            "probability_of_rise_1": ratios.rise,
            "probability_risen_beyond_threshold_1": ratios.risen,
            "probability_fallen_beyond_threshold_1": ratios.fallen,
            "probability_of_change_1": ratios.changed,
            "changed": ratios.one_way > change.probability,
            "threshold_1": change.threshold,
            "smallest_detectable_change_1": ratios.detectable,
            "narrower_than_independent_1": ratios.narrowing,
            "from_verdict": change.verdict[0],
            "to_verdict": change.verdict[1],
            "one_person_p_value_1": pair.p_value,
            "one_person": not pair.flagged,
            "shared_distance_sd": pair.distance,
            "log_bayes_factor_1": pair.log_bayes_factor,
            "sampler": change.sampler,
            "converged": change.converged,
            "k_hat_1": change.k_hat,
            "efficiency_1": change.efficiency,
        }
    )


def change_lines(change: StoredChange) -> list[str]:
    """Return verdicts, ratios and the sampling check in lines."""
    return [
        f"{change.person}: {change.visit[0]} to {change.visit[1]}",
        *(f"  {line}" for line in verdict_lines(change)),
        *ratio_lines(change),
        sampling_line(change),
        shares_line(change),
    ]


def verdict_lines(change: StoredChange) -> list[str]:
    """Return the verdict of each visit and of the pair, and what has changed."""
    by_visit = [
        f"{visit} ({subject}): {verdict} by itself"
        for visit, subject, verdict in zip(change.visit, change.subject, change.verdict, strict=True)
    ]
    return [*by_visit, pair_line(change), changed_line(change)]


def pair_line(change: StoredChange) -> str:
    """Return whether both recordings can be of one person."""
    pair = change.one_person
    found = (
        f"p = {pair.p_value:.3f}, {pair.distance:.1f} posterior standard deviations apart in what is shared"
    )
    if pair.flagged:
        return (
            f"the two recordings are NOT of one person by what visits share ({found}); do not use the ratios"
        )
    return f"the two recordings can be of one person ({found})"


def changed_line(change: StoredChange) -> str:
    """Return what has changed, by the rule."""
    rule = (
        f"by more than {change.threshold:.0%} in one direction with probability above {change.probability:g}"
    )
    if not change.changed:
        return f"nothing has changed {rule}"
    return f"changed {rule}: {', '.join(OF_QUANTITY[name] for name in change.changed)}"


def ratio_rows(change: StoredChange) -> list[tuple[str, ...]]:
    """Return the table of ratios, its head first: texts, a row a quantity."""
    head = (
        "later / earlier", "median", f"{change.interval_mass:.0%} interval", "P(rise)",
        f"P(> {change.threshold:.0%})", "detectable", "narrower by",
    )  # fmt: skip
    ratios = change.ratios
    rows = [
        (
            OF_QUANTITY[name],
            f"{ratios.median[j]:.2f}",
            f"{ratios.low[j]:.2f} to {ratios.high[j]:.2f}",
            f"{ratios.rise[j]:.3f}",
            f"{ratios.changed[j]:.3f}",
            f"{ratios.detectable[j]:.0%}",
            f"{ratios.narrowing[j]:.0%}",
        )
        for j, name in enumerate(change.quantity)
    ]
    return [head, *rows]


def ratio_lines(change: StoredChange) -> list[str]:
    """Return the table of ratios in aligned lines."""
    return [
        f"{first:{WIDTH}}" + "".join(f"{text:>15}" for text in rest) for first, *rest in ratio_rows(change)
    ]


def sampling_line(change: StoredChange) -> str:
    """Return how reliable the joint draws are."""
    by, doubt = drawn_by(change)
    return (
        f"sampling check: draws by {by}; of {change.weighted_draws} weighted draws {change.efficiency:.1%} "
        f"effective, k-hat {change.k_hat:.2f} (at most {change.k_hat_limit:.2f}){doubt}"
    )


def shares_line(change: StoredChange) -> str:
    """Return what visits share, as configured."""
    told = ", ".join(
        f"{OF_NUISANCE.get(name, f'{name} of the model')} {share:g}"
        for name, share in zip(change.share, change.shares, strict=True)
    )
    return (
        f"conditional on what visits are said to share (0 nothing, 1 all): {told}; all else is each "
        "visit's own"
    )


def drawn_by(stored: StoredChange | CohortPosterior) -> tuple[str, str]:
    """Return what gave the draws, and a warning where they are not reliable."""
    by = "MCMC" if stored.sampler == "mcmc" else "importance weights"
    return by, "" if stored.converged else "; NOT CONVERGED, do not use"
