"""What is kept of a person's change: joint draws, how reliable they are, ratios, verdicts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from swesbi.artefacts import Artefact, Labels, Part, Variable
from swesbi.base.arrays import FloatArray
from swesbi.persons.change.joint import Change
from swesbi.persons.change.ratios import QUANTITIES, UNITS, OnePerson, Ratios
from swesbi.persons.settings import ChangeSettings

SEPARATOR: Final = "; "
VISIT: Final = "visit"


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


def stored_change(
    change: Change,
    person: str,
    visits: tuple[str, str],
    subjects: tuple[str, str],
    verdicts: tuple[str, str],
    settings: ChangeSettings,
    parameters: tuple[str, ...],
) -> StoredChange:
    """Return what is kept of a change: whose, between which visits and recordings, of which verdicts."""
    exact, shares = change.exact, settings.shares.model_dump()
    return StoredChange(
        visit=visits,
        quantity=QUANTITIES,
        parameter=parameters,
        share=tuple(shares),
        person=person,
        subject=np.array(subjects),
        verdict=np.array(verdicts),
        phi=change.phi,
        quantities=change.quantities,
        shares=np.array(list(shares.values())),
        ratios=change.ratios,
        one_person=change.one_person,
        sampler=exact.sampler,
        converged=exact.converged,
        reasons=SEPARATOR.join(exact.reasons),
        k_hat=exact.k_hat,
        k_hat_limit=exact.k_hat_limit,
        efficiency=exact.efficiency,
        weighted_draws=len(exact.weighted.phi),
        log_evidence=exact.log_evidence,
        log_evidence_se=exact.weighted.log_evidence_se,
        interval_mass=settings.exact.interval,
        threshold=settings.rule.threshold,
        probability=settings.rule.probability,
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
