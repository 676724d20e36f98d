"""Settings of a person's visits: what they share, when a change counts, the effort of the joint posterior."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np
from pydantic import Field

from swesbi.base.arrays import FloatArray
from swesbi.base.settings import Level, Settings
from swesbi.posterior.settings import ExactSettings


def _share(of: str, why: str = "the organ is the same") -> float:
    """Return the field of a share, which pydantic takes in place of a value."""
    described = f"Share of the {of}. Chosen: {why}."
    return cast("float", Field(ge=0.0, lt=1.0, json_schema_extra={"unit": "1"}, description=described))


class SharesSettings(Settings):
    """What two visits of one person have in common; every other parameter is each visit's own.

    Of a parameter it is the correlation of its normal scores: 0 makes the visits strangers in it, and the
    nearer it is to 1, the closer are both values. Of the discrepancy it is the share of its variance that is
    the same at the same phase.

    Each visit's own are theta, the passive stiffness, loading (R_d, R_d C_s, the stressed volume), onset
    and duration of activation. There are no repeated measurements of any. Chosen: .9 of an organ that
    is the same. Visits of one person so make a tenth of the variance over persons and visits. What the
    investigator sets anew has .8.
    """

    activation_ramp_s: float = _share("width of the ramps of activation")
    destruction_alpha: float = _share("bonds destroyed per unit of strain")
    sigma_0_pa: float = _share("stress of the fully activated fibre")
    passive_wall_factor: float = _share("factor of the passive wall's moduli")
    length_dependence: float = _share("length dependence of the bonds")
    passive_ratio: float = _share("ratio of the passive stiffness at both ends")
    passive_middle_factor: float = _share("factor of the passive stiffness between")
    speed_scale: float = _share(
        "scale of all speeds", "plate thickness and dispersion stay, the angle to the fibres is set anew"
    )
    discrepancy: float = Field(
        ge=0.0,
        le=1.0,
        json_schema_extra={"unit": "1"},
        description="Share of the variance of the discrepancy, at the same phase. Chosen: equations that "
        "miss a heart miss it again.",
    )

    def of(self, names: Sequence[str]) -> FloatArray:
        """Return the share of each of these parameters, 0 where it is the visit's own; shape (d,)."""
        shares = self.model_dump()
        return np.array([shares.get(name, 0.0) for name in names])

    @property
    def by_name(self) -> dict[str, float]:
        """All of them, the discrepancy's last."""
        return {name: float(value) for name, value in self.model_dump().items()}


class ChangeRuleSettings(Settings):
    """When a quantity has changed, and when two recordings are not of one person."""

    threshold: float = Field(
        gt=0.0,
        lt=1.0,
        description="Smallest relative change that counts. Chosen: a smaller change of the ratio is none.",
    )
    probability: Level = Field(
        description="Probability of a change beyond the threshold in one direction, above which it is "
        "one. Chosen."
    )
    power: Level = Field(
        description="Power with which the smallest detectable change is found. As studies are planned."
    )
    one_person_level: float = Field(
        gt=0.0,
        lt=0.5,
        description="False-alarm rate of the test that both recordings are of one person. Chosen.",
    )
    null_draws: int = Field(
        ge=100,
        description="Simulated pairs of one person behind that test. Chosen: p-values of .05 to half a "
        "point.",
    )


class ChangeSettings(Settings):
    """The joint posterior of a person's visits, and what is reported of it."""

    shares: SharesSettings = Field(description="What visits have in common.")
    rule: ChangeRuleSettings = Field(description="When a quantity has changed.")
    exact: ExactSettings = Field(description="The effort, as for a recording with twice the parameters.")
