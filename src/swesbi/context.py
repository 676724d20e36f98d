"""The subject-specific context c_d: anatomy, physiology and demography of one subject."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np

from swesbi.artefacts import Variable
from swesbi.base.arrays import FloatArray

# d_0 / R_0: 0.3 in health, 0.7 in the most severe hypertrophy; at 2 the mid-wall sphere has no cavity left.
RELATIVE_THICKNESS_RANGE: Final = (0.04, 1.0)


@dataclass(frozen=True)
class SubjectVariable:
    """One column of ``subjects.csv``: a component of the context vector, or what else is known of a subject.

    Artefacts and tables call it ``name``, which ends in the unit, the page ``words``, an axis ``short``. A
    text has no unit. The template of ``subjects.csv`` asks for ``asked`` in ``asked_unit``, with an
    ``example``. The page shows it in ``shown_unit``, with so many ``digits`` behind the point. ``bounds`` are
    the lowest and highest value that is taken, which catch wrong units; a choice has none. What is
    ``simulated`` enters the forward model, which is declared within the bounds. ``entered`` is the column of
    ``subjects.csv`` where that is not the name.
    """

    name: str
    unit: str
    words: str
    short: str
    asked: str
    example: str
    asked_unit: str = ""
    shown_unit: str = ""
    digits: int = 0
    bounds: tuple[float, float] | None = None
    simulated: bool = False
    entered: str = ""

    @property
    def label(self) -> str:
        """What an axis says, the unit included."""
        return f"{self.short} ({self.shown_unit})"

    @property
    def declared(self) -> tuple[float, float] | None:
        """Range in which the forward model is declared, if it takes this value."""
        return self.bounds if self.simulated else None

    @property
    def column(self) -> str:
        """Its column of ``subjects.csv``."""
        return self.entered or self.name

    @property
    def remedy(self) -> str:
        """What to do about a value that is refused."""
        if not self.asked_unit:
            return f"write {self.asked}"
        return f"correct the cell (units? the column is in {self.asked_unit})"


# From a newborn to the most dilated heart, from sinus bradycardia to the fastest exercise (Lang et al. 2015).
CONTEXT: Final = (
    SubjectVariable("sex_male", "1", "sex (male = 1)", "male", "F or M", "F", entered="sex"),
    SubjectVariable(
        "age_years", "year", "age", "age", "years", "31", "years", "years", bounds=(0.0, 120.0)
    ),
    SubjectVariable(
        "bsa_m2", "m2", "body surface area", "BSA", "body surface area in m2", "1.71", "m2", "m²", digits=2,
        bounds=(0.1, 4.0),
    ),
    SubjectVariable(
        "hr_bpm", "1/min", "heart rate", "heart rate", "heart rate during the recording, beats per minute",
        "66", "beats per minute", "1/min", bounds=(30.0, 220.0), simulated=True,
    ),
    SubjectVariable(
        "lvedv_ml", "mL", "LVEDV", "LVEDV", "left ventricular end-diastolic volume in mL",
        "95", "mL", "mL", bounds=(10.0, 500.0), simulated=True,
    ),
    SubjectVariable(
        "lvesv_ml", "mL", "LVESV", "LVESV", "left ventricular end-systolic volume in mL", "36", "mL", "mL",
        bounds=(1.0, 500.0),
    ),
    SubjectVariable(
        "ivsd_cm", "cm", "septal thickness", "IVSd",
        "thickness of the interventricular septum at end diastole in cm",
        "0.82", "cm", "cm", digits=2, bounds=(0.2, 3.0), simulated=True,
    ),
)  # fmt: skip
"""The components of c_d in their order."""
CONTEXT_NAMES: Final = tuple(variable.name for variable in CONTEXT)
CONTEXT_UNITS: Final = tuple(variable.unit for variable in CONTEXT)
CONTEXT_BOUNDS: Final = {variable.name: variable.bounds for variable in CONTEXT if variable.bounds}
CONTEXT_RANGES: Final = {variable.name: variable.declared for variable in CONTEXT if variable.declared}


def sphere_radius_m(volume_ml: float) -> float:
    """Return the radius of a sphere of this volume."""
    return float(np.cbrt(3e-6 * volume_ml / (4.0 * np.pi)))


@dataclass(frozen=True)
class Context:
    """One subject's context.

    HR, IVSd and LVEDV set the simulator (paper, Eq. 2); the others condition the posterior only. The septum
    stands for the whole sphere: its thickness is that of every part of the wall.
    """

    subject: str
    sex: Annotated[Literal["F", "M"], Variable("", "1", "F or M")]
    age_years: Annotated[float, Variable("", "year", "age")]
    bsa_m2: Annotated[float, Variable("", "m2", "body surface area")]
    hr_bpm: Annotated[float, Variable("", "min-1", "heart rate")]
    lvedv_ml: Annotated[float, Variable("", "mL", "left ventricular end-diastolic volume")]
    lvesv_ml: Annotated[float, Variable("", "mL", "left ventricular end-systolic volume")]
    ivsd_cm: Annotated[float, Variable("", "cm", "interventricular septal thickness at end diastole")]

    @property
    def period_s(self) -> float:
        """Cardiac period T_d = 60 / HR (paper, Eq. 2)."""
        return 60.0 / self.hr_bpm

    @property
    def thickness_m(self) -> float:
        """Reference wall thickness d_0 = 1e-2 IVSd (paper, Eq. 2)."""
        return 1e-2 * self.ivsd_cm

    @property
    def radius_m(self) -> float:
        """Reference radius R_0 of a sphere of volume LVEDV (paper, Eq. 2)."""
        return sphere_radius_m(self.lvedv_ml)

    @property
    def relative_thickness(self) -> float:
        """Wall thickness over radius, d_0 / R_0."""
        return self.thickness_m / self.radius_m

    def as_array(self) -> FloatArray:
        """Return the context values in the order of ``CONTEXT_NAMES``; sex, the first, is 1 for male."""
        return np.array([float(self.sex == "M"), *(getattr(self, name) for name in CONTEXT_NAMES[1:])])


def outside(values: Mapping[str, Any], bounds: Mapping[str, tuple[float, float]]) -> list[str]:
    """Say which values are outside their bounds; what is not there, or None, has none."""
    known = [(name, values[name], bounds[name]) for name in bounds if values.get(name) is not None]
    return [
        f"{name} = {value:g} is outside [{low:g}, {high:g}]"
        for name, value, (low, high) in known
        if not low <= value <= high
    ]


def check_bounds(values: Mapping[str, Any], bounds: Mapping[str, tuple[float, float]]) -> None:
    """Raise a ``ValueError`` of the first value outside its bounds."""
    if problems := outside(values, bounds):
        raise ValueError(problems[0])


def check_ranges(context: Context) -> None:
    """Raise a ``ValueError`` of a context outside the ranges in which the forward model is declared."""
    try:
        check_bounds(vars(context), CONTEXT_RANGES)
    except ValueError as error:
        raise ValueError(f"subject {context.subject}: {error}; check its unit") from None
    low, high = RELATIVE_THICKNESS_RANGE
    if not low <= context.relative_thickness <= high:
        raise ValueError(
            f"subject {context.subject}: {wall_in_words(context)}; expected {low:g} to {high:g}; "
            "check both units"
        )


def wall_in_words(context: Context) -> str:
    """Say how thick the wall is: "ivsd_cm = 2 is 0.823 of the radius of a sphere of lvedv_ml = 60"."""
    return (
        f"ivsd_cm = {context.ivsd_cm:g} is {context.relative_thickness:.3g} of the radius of a sphere of "
        f"lvedv_ml = {context.lvedv_ml:g}"
    )
