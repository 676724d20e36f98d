"""The inferred parameters: names, units, meanings, order, declared ranges, labels, and priors of single ones.

theta = (k_0, k_ATP, k_SR) drives the forward model. phi = (theta, a, nuisances) joins it with the passive
stiffness a at the largest stretch of the beat, and with whatever nuisance parameters a prior frees:
physiology of the heart, which its simulation takes, and three of the measurement. Arrays have them along
their last axis, in this order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Final, Self

from pydantic import Field, model_validator
from pydantic.config import JsonDict

from swesbi.base.settings import Settings

ISOMETRIC: Final = "isometric_stiffness_kpa"
ISOMETRIC_SYMBOL: Final = r"$k_0(1-e^{-k_\mathrm{ATP}D_T})$"
"""Name and symbol of the isometric stiffness, reached at constant length by the end of activation: what the
data know best of k_0 and k_ATP."""


@dataclass(frozen=True)
class Parameter:
    """One inferred parameter; its name, in configuration, artefacts and tables, ends in the unit.

    Its meaning stands in words before its symbol. ``tex`` is for figures and LaTeX, ``html`` for the page,
    ``text`` for Markdown and the terminal. ``si`` is what a value is multiplied by for SI units,
    ``declared`` the range in which the forward model is declared, in ``unit``; a prior lies within.
    ``title`` is what figures call it before its symbol, if anything.
    """

    name: str
    unit: str
    meaning: str
    tex: str
    html: str
    text: str
    si: float = 1.0
    declared: tuple[float, float] = (0.0, math.inf)
    title: str = ""

    @property
    def label(self) -> str:
        """Title, symbol and unit in TeX, for an axis or a row."""
        return f"{self.title} {self.tex} ({self._unit('$^{-1}$')})".strip()

    @property
    def cf_unit(self) -> str:
        """The unit as artefacts say it, by the CF conventions: a reciprocal as a power."""
        return self._unit("-1")

    @property
    def html_unit(self) -> str:
        """The unit on the page: a reciprocal as a power."""
        return self._unit("⁻¹")

    def _unit(self, power: str) -> str:
        """Return the unit, a reciprocal by this power."""
        return f"{self.unit.removeprefix('1/')}{power}" if self.unit.startswith("1/") else self.unit


# Declared ranges: an order of magnitude beyond published parameters of myocardium (Marchesseau et al. 2013;
# Banus et al. 2021), so that any prior of a study fits inside, yet a wrong unit does not.
THETA: Final = (
    Parameter(
        "k0_kpa", "kPa", "active stiffness scale", "$k_0$", "<i>k</i><sub>0</sub>", "k_0",
        si=1e3, declared=(1.0, 500.0),
    ),
    Parameter(
        "k_atp_per_s", "1/s", "contraction rate", r"$k_\mathrm{ATP}$", "<i>k</i><sub>ATP</sub>", "k_ATP",
        declared=(0.1, 500.0),
    ),
    Parameter(
        "k_sr_per_s", "1/s", "relaxation rate", r"$k_\mathrm{SR}$", "<i>k</i><sub>SR</sub>", "k_SR",
        declared=(0.1, 300.0),
    ),
)  # fmt: skip
"""The active parameters: stiffness scale, contraction rate and relaxation rate."""
PASSIVE: Final = Parameter(
    "passive_stiffness_kpa", "kPa", "passive stiffness at the beat's largest stretch",
    "$a$", "<i>a</i>", "a", si=1e3, title="passive stiffness",
)  # fmt: skip
PHI: Final = (*THETA, PASSIVE)
"""What is reported of all that is inferred from speeds: theta, and the passive stiffness last."""
OF_THETA: Final = slice(len(THETA))
STRETCHED: Final = len(THETA)
"""Where theta and the passive stiffness at the largest stretch stand in phi."""
OF_INTEREST: Final = slice(len(PHI))
"""Where all that is reported stands in phi; nuisance parameters follow."""

# Declared ranges: about an order of magnitude around the shipped settings of the forward model, wide enough
# for any prior, while a value in another unit (ms, kPa, mL/mmHg) lies outside.
PHYSIOLOGY: Final = (
    Parameter(
        "activation_onset_s", "s", "onset of activation after the R peak", r"$t_\mathrm{on}$",
        "<i>t</i><sub>on</sub>", "t_on", declared=(0.0, 0.3),
    ),
    Parameter(
        "activation_duration_s", "s", "duration of activation at a period of 0.8 s", "$D$", "<i>D</i>", "D",
        declared=(0.03, 1.5),
    ),
    Parameter(
        "activation_ramp_s", "s", "width of the activation's ramps", "$w$", "<i>w</i>", "w",
        declared=(0.002, 0.25),
    ),
    Parameter(
        "destruction_alpha", "1", "bonds destroyed per unit of strain", r"$\alpha$", "<i>α</i>", "alpha",
        declared=(0.0, 50.0),
    ),
    Parameter(
        "sigma_0_pa", "Pa", "stress of the fully activated fibre", r"$\sigma_0$",
        "<i>σ</i><sub>0</sub>", "sigma_0", declared=(5e3, 1e6),
    ),
    Parameter(
        "passive_wall_factor", "1", "factor of the passive wall's moduli", "$f_C$",
        "<i>f<sub>C</sub></i>", "f_C", declared=(0.05, 20.0),
    ),
    Parameter(
        "distal_resistance_pa_s_m3", "Pa s/m3", "distal resistance", "$R_d$", "<i>R<sub>d</sub></i>", "R_d",
        declared=(1e7, 1.5e9),
    ),
    Parameter(
        "arterial_time_constant_s", "s", "time constant of the arteries, resistance times capacitance",
        "$R_d C_s$", "<i>R<sub>d</sub>C<sub>s</sub></i>", "R_d C_s", declared=(0.05, 15.0),
    ),
    Parameter(
        "stressed_volume_factor", "1", "factor of the circulation's stressed volume", "$f_V$",
        "<i>f<sub>V</sub></i>", "f_V", declared=(0.3, 3.0),
    ),
    Parameter(
        "length_dependence", "1", "share of the length dependence of bonds", r"$\gamma$", "<i>γ</i>", "gamma",
        declared=(0.0, 1.5),  # a prior ends at 1; differences at its bound step beyond
    ),
    Parameter(
        "atrial_kick_pa", "Pa", "rise of the atrial pressure by atrial contraction", "$P_a$",
        "<i>P<sub>a</sub></i>", "P_a", declared=(0.0, 1e4),
    ),
    Parameter(
        "atrial_delay_s", "s", "start of atrial contraction, from 0.26 s before the R peak", "$d_a$",
        "<i>d<sub>a</sub></i>", "d_a", declared=(0.0, 0.4),
    ),
)  # fmt: skip
"""Nuisance parameters that the simulation of a heart takes."""
OPERATOR: Final = (
    Parameter(
        "passive_ratio", "1", "passive stiffness at the beat's smallest stretch over that at its largest",
        "$r$", "<i>r</i>", "r", declared=(1e-3, 1e3),
    ),
    Parameter(
        "passive_middle_factor", "1", "passive stiffness at the middle stretch over the ends' geometric mean",
        "$m$", "<i>m</i>", "m", declared=(0.05, 20.0),
    ),
    Parameter("speed_scale", "1", "scale of all speeds", "$q$", "<i>q</i>", "q", declared=(0.2, 5.0)),
)  # fmt: skip
"""Nuisance parameters of the measurement, which need no simulation of their own."""
NUISANCES: Final = (*PHYSIOLOGY, *OPERATOR)
"""All that may be inferred beside what is reported and is integrated out, in the order of phi's columns."""

PEAK_ACTIVE: Final = Parameter(
    "peak_active_kpa", "kPa", "peak active stiffness", r"$E_\mathrm{act}^\mathrm{max}$",
    "max <i>E</i><sub>act</sub>", "max E_act",
)  # fmt: skip
HALF_ACTIVE: Final = Parameter(
    "half_active_ms", "ms", "time after R at which the active part has halved", "$t_{1/2}$",
    "<i>t</i><sub>1/2</sub>", "t_1/2",
)  # fmt: skip
ACTIVE_SHARE: Final = Parameter(
    "active_share", "1", "active share of the peak", r"$E_\mathrm{act}/E$",
    "<i>E</i><sub>act</sub>/<i>E</i>", "E_act/E",
)  # fmt: skip
ISOMETRIC_STIFFNESS: Final = Parameter(
    ISOMETRIC, "kPa", "isometric stiffness", ISOMETRIC_SYMBOL,
    "<i>k</i><sub>0</sub>(1 − exp(−<i>k</i><sub>ATP</sub><i>D<sub>T</sub></i>))", "k_0(1 - exp(-k_ATP D_T))",
)  # fmt: skip
CURVE: Final = (
    Parameter("duration_ms", "ms", "duration", r"$t_{50\,50}$", "<i>t</i><sub>50-50</sub>", "t_50-50"),
    Parameter("peak_kpa", "kPa", "peak stiffness", r"$E^\mathrm{max}$", "max <i>E</i>", "max E"),
    Parameter(
        "decay_rate_per_s", "1/s", "decay rate", r"$r_{75\,25}$", "<i>r</i><sub>75-25</sub>", "r_75-25"
    ),
    Parameter(
        "half_relaxation_ms", "ms", "half-relaxation time", r"$t_{50}$", "<i>t</i><sub>50</sub>", "t_50"
    ),
    Parameter(
        "late_diastole_kpa", "kPa", "late-diastolic stiffness", r"$E_\mathrm{dia}$", "<i>E</i><sub>dia</sub>",
        "E_dia",
    ),
)  # fmt: skip
"""Told of the curve: full width at half of the rise, largest value, rate of the fall from 75 to 25 %, time
from the peak to half, late-diastolic mean."""
DERIVED: Final = (PEAK_ACTIVE, *CURVE, HALF_ACTIVE, ACTIVE_SHARE, ISOMETRIC_STIFFNESS)
DERIVED_NAMES: Final = tuple(quantity.name for quantity in DERIVED)
QUANTITIES: Final = {quantity.name: quantity for quantity in (*PHI, *NUISANCES, *DERIVED)}
"""All of the above by name."""
REPORTED: Final = tuple(
    QUANTITIES[name]
    for name in (
        "duration_ms",
        "peak_kpa",
        "late_diastole_kpa",
        "decay_rate_per_s",
        "half_active_ms",
        "k_sr_per_s",
        "peak_active_kpa",
        "active_share",
        "passive_stiffness_kpa",
        ISOMETRIC,
        "k0_kpa",
        "k_atp_per_s",
    )
)
"""All that an answer tells, in the order in which it can be relied on (``verdict.answer_lines``)."""
REPORTED_NAMES: Final = tuple(quantity.name for quantity in REPORTED)

THETA_NAMES: Final = tuple(parameter.name for parameter in THETA)
THETA_LABELS: Final = tuple(parameter.label for parameter in THETA)
THETA_SYMBOLS: Final = tuple(parameter.tex for parameter in THETA)
THETA_SI: Final = tuple(parameter.si for parameter in THETA)
THETA_RANGES: Final = tuple(parameter.declared for parameter in THETA)
THETA_COLUMNS: Final = ", ".join(parameter.cf_unit for parameter in THETA)
PHI_COLUMNS: Final = ", ".join(parameter.cf_unit for parameter in PHI)
NUISANCE_COLUMNS: Final = "as named in nuisance"
"""Units of the columns of theta, of phi and of nuisance parameters, as artefacts say them."""
PHI_NAMES: Final = tuple(parameter.name for parameter in PHI)
PHYSIOLOGY_NAMES: Final = tuple(parameter.name for parameter in PHYSIOLOGY)
OPERATOR_NAMES: Final = tuple(parameter.name for parameter in OPERATOR)
K_0, K_ATP = (THETA_NAMES.index(name) for name in ("k0_kpa", "k_atp_per_s"))
"""Where the two parameters of the isometric stiffness stand."""
PHI_LABELS: Final = tuple(parameter.label for parameter in PHI)
PHI_SYMBOLS: Final = {parameter.name: parameter.tex for parameter in PHI}
"""Symbols in TeX by name."""

Positive = Annotated[float, Field(gt=0.0)]
OF_ITS_KEY: Final[JsonDict] = {"unit": "of its key"}


class ParameterPrior(Settings):
    """Bounded log-Gaussian prior of one parameter; centre and bounds in the parameter's unit."""

    centre: Positive = Field(description="Exp of the mean of log theta.", json_schema_extra=OF_ITS_KEY)
    log_sd: Positive = Field(description="Standard deviation of log theta.")
    low: Positive = Field(description="Hard lower bound.", json_schema_extra=OF_ITS_KEY)
    high: Positive = Field(description="Hard upper bound.", json_schema_extra=OF_ITS_KEY)

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if not self.low < self.centre < self.high:
            raise ValueError(f"need low < centre < high, found {self.low} / {self.centre} / {self.high}")
        return self


class NuisanceSettings(Settings):
    """Priors of nuisance parameters; one that has none is fixed at the value of the forward model's settings.

    R_d and the time constant R_d C_s are independent, so that R_d and C_s are negatively correlated; the
    duration is that at the reference period, which a subject's heart rate scales.

    Recordings tell little of them; they are drawn with every simulation. Centres are those of
    `forward_model`, or round values about them. Widths are what is known of healthy adults, or a
    judgement that says so. Bounds lie at three standard deviations for `length_dependence`,
    `passive_ratio` and `passive_middle_factor`, and at about four for the others. Deleting a line fixes the
    parameter: ratios, factors and scales at 1, others at `forward_model`.
    """

    activation_onset_s: ParameterPrior | None = Field(
        default=None,
        description="Onset of activation after the R peak. The pre-ejection period has a standard "
        "deviation of 13 ms at a given heart rate (Weissler et al., Circulation 1968;37:149).",
    )
    activation_duration_s: ParameterPrior | None = Field(
        default=None,
        description="Duration of activation at the reference period. At 75 beats a minute the second "
        "heart sound follows the R peak by 350 ms, with a standard deviation of 14 ms between persons "
        "(Weissler et al., Circulation 1968;37:149). How much of that is the duration is not known: from "
        "0.26 to 0.42 s at two standard deviations (chosen). The duration follows heart rate by the "
        "square root of the period, as in `forward_model`.",
    )
    activation_ramp_s: ParameterPrior | None = Field(
        default=None,
        description="Width of the ramps of activation. Calcium in human myocytes rises from 10 to 90 % "
        "within 15 to 60 ms, by preparation and temperature. The wall is activated one part after another "
        "besides. From 10 to 100 ms at two standard deviations (chosen).",
    )
    destruction_alpha: ParameterPrior | None = Field(
        default=None,
        description="Bonds destroyed per unit of strain. There is no measurement; a factor of two either "
        "way at two standard deviations (chosen).",
    )
    sigma_0_pa: ParameterPrior | None = Field(
        default=None,
        description="Stress of the fully activated fibre. Strips of failing hearts develop half the "
        "stress of healthy ones (Hasenfuss et al., Circ Res 1992;70:1225), whole hearts 70 % "
        "(Efstratiadis and Michaels, J Card Fail 2008;14:577). A factor of 1.8 either way at two standard "
        "deviations, so that failing hearts lie within (chosen).",
    )
    passive_wall_factor: ParameterPrior | None = Field(
        default=None,
        description="Factor of the passive moduli of the wall. Moduli of healthy hearts differ by a "
        "quarter and more between persons (fits to MRI: Genet et al., J Appl Physiol 2014;117:142). With "
        "patients they differ by a factor of four (Bortone et al., J Am Coll Cardiol 1989;14:613). A wall "
        "a third as stiff as in `forward_model` is PhysioBlocks' (chosen to hold all of these).",
    )
    distal_resistance_pa_s_m3: ParameterPrior | None = Field(
        default=None,
        description="Systemic vascular resistance. The reference range, 700 to 1600 dyn s/cm5, spans four "
        "standard deviations of the log.",
    )
    arterial_time_constant_s: ParameterPrior | None = Field(
        default=None,
        description="Time constant R_d C_s of the arterial decay. Stroke volume over pulse pressure "
        "varies by a quarter (de Simone et al., J Am Coll Cardiol 1999;33:800). Resistance explains a "
        "part of that. R_d and C_s are thereby negatively correlated (-0.7).",
    )
    stressed_volume_factor: ParameterPrior | None = Field(
        default=None,
        description="Factor of the stressed volume, by which the heart is filled. Blood volume of persons "
        "of one size varies by a tenth (Feldschuh and Enson, Circulation 1977;56:605). Its stressed share "
        "and the filling pressure vary more: wedge pressures reach 13 mmHg in the healthy (Zeder et al., "
        "Eur Respir J 2024;64:2400967) and 22 in patients (Bortone et al. 1989). A factor of 1.6 either "
        "way at two standard deviations (chosen).",
    )
    length_dependence: ParameterPrior | None = Field(
        default=None,
        description="Share of the length dependence of the bonds that PhysioBlocks' human heart has. None, "
        "at 0, is the paper's. What septa have in vivo is not known (chosen: from nearly none to all).",
    )
    atrial_kick_pa: ParameterPrior | None = Field(
        default=None,
        description="Rise of the atrial pressure by atrial contraction. Healthy left atria reach 10.4 "
        "mmHg in the a wave, over a mean of 7.9 (Braunwald et al., Circulation 1961;24:267). Some hardly "
        "contract, others raise it by 15 mmHg (chosen). The source lies behind the pulmonary capacitance, "
        "so that the atrium shows about seven tenths of it.",
    )
    atrial_delay_s: ParameterPrior | None = Field(
        default=None,
        description="Start of atrial contraction, from 0.26 s before the R peak. The mitral annulus moves "
        "54 ms after the P wave begins (Akamatsu et al., Cardiovasc Ultrasound 2020), and PR is about 160 "
        "ms. At the centre it lasts from 0.13 s before the R peak to 0.01 s after it (chosen).",
    )
    passive_ratio: ParameterPrior | None = Field(
        default=None,
        description="Passive stiffness at the smallest stretch of the beat, over that at the largest. "
        "Stretched myocardium stiffens, which gives ratios below 1. Below its resting length it resists too "
        "(restoring force of titin: Helmes et al., Circ Res 1996;79:619), which gives ratios above 1. "
        "Neither is likelier beforehand. Chosen on hearts of development (studies/validation). Bounds lie at "
        "three standard deviations.",
    )
    passive_middle_factor: ParameterPrior | None = Field(
        default=None,
        description="Passive stiffness at the middle stretch, over the geometric mean of both ends. At 1 its "
        "logarithm is linear in stretch. Chosen on hearts of development (studies/validation). Bounds lie at "
        "three standard deviations.",
    )
    speed_scale: ParameterPrior | None = Field(
        default=None,
        description="Scale of all speeds of a recording. Plate thickness, fibre angle and dispersion make "
        "it. Systems differ by about 5 % on the same phantoms (RSNA/QIBA: Hall et al., IEEE Int Ultrason "
        "Symp 2013; Palmeri et al., J Ultrasound Med 2021;40:569).",
    )

    def freed(self, names: Iterable[str]) -> dict[str, ParameterPrior]:
        """Return the priors of those of these names that have one, in the order of the names."""
        return {name: prior for name in names if (prior := getattr(self, name)) is not None}

    @model_validator(mode="after")
    def _check_ranges(self) -> Self:
        for parameter in NUISANCES:
            prior, (low, high) = getattr(self, parameter.name), parameter.declared
            if prior is not None and (prior.low < low or prior.high > high):
                raise ValueError(
                    f"{parameter.name}: bounds {prior.low:g} to {prior.high:g} leave [{low:g}, {high:g}], "
                    "the range of the forward model; check the unit"
                )
        return self
