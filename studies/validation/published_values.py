"""Published values of hearts that the model can be held against, as their authors state them.

Each says which of the table's quantities it is nearest to, and how near. None is fitted, but the prior of
the passive stiffness was chosen with Villemain 2019 and Song 2016 in view.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

ADULTS: Final = (18.0, 85.0)
"""Ages of the adults of the population, in years."""


@dataclass(frozen=True)
class Quantity:
    """One quantity of a heart in the table.

    Attributes:
        name: Its name there; it ends in the unit where it has one.
        unit: The unit in plain text.
        title: What it is, in words.
    """

    name: str
    unit: str
    title: str


LATE_SPEED: Final = Quantity("late_speed_m_s", "m/s", "Speed in late diastole")
LATE_YOUNG: Final = Quantity("late_diastole_kpa", "kPa", "Young's modulus in late diastole")
LATE_SHEAR: Final = Quantity("late_shear_kpa", "kPa", "Shear modulus in late diastole")
PEAK_SPEED: Final = Quantity("peak_speed_m_s", "m/s", "Largest speed of the beat")
PEAK_TIME: Final = Quantity("peak_time_ms", "ms", "Time of the largest speed after R")
RATIO: Final = Quantity("ratio", "1", "Stiffness, peak over late diastole")
HALF_RELAXATION: Final = Quantity("half_relaxation_ms", "ms", "Time from the peak to half of the fall")
DECAY_SLOPE: Final = Quantity("decay_slope", "1", "Stiffness decay on pressure, slope")
DECAY_R: Final = Quantity("decay_r", "1", "Stiffness and pressure, correlation")
EJECTION: Final = Quantity("ejection_ms", "ms", "Ejection time")
CONTRACTION: Final = Quantity("isovolumic_contraction_ms", "ms", "Isovolumic contraction time")
FRACTION: Final = Quantity("ejection_fraction", "1", "Ejection fraction")
FILLING: Final = Quantity("filling_ratio", "1", "Mitral flow, early over atrial")
QUANTITIES: Final = (
    LATE_SPEED, RATIO, LATE_YOUNG, LATE_SHEAR, PEAK_SPEED, PEAK_TIME, HALF_RELAXATION, DECAY_SLOPE, DECAY_R,
    EJECTION, CONTRACTION, FRACTION, FILLING,
)  # fmt: skip
"""In the order of the figure."""
OVER_HEARTS: Final = (DECAY_SLOPE, DECAY_R)
"""Told by several hearts together, where the others are told by one."""


@dataclass(frozen=True)
class Published:
    """One published value.

    Attributes:
        quantity: What of the model it is held against.
        source: First author, year and journal.
        label: What tells it from others of the source, in a word or two.
        hearts: Whose hearts, how many, and how they were seen.
        low: Lower end of the interval, in the quantity's unit.
        middle: Mean; NaN where none is stated.
        high: Upper end.
        interval: What the ends are.
        compared: How near the published quantity is to the model's.
        checked: Which of it was read where; what was not.
        ages: Whose simulations it is held against, in years.
    """

    quantity: Quantity
    source: str
    label: str
    hearts: str
    low: float
    middle: float
    high: float
    interval: str
    compared: str
    checked: str
    ages: tuple[float, float] = ADULTS


def mean_and_sd(
    mean: float, sd: float, quantity: Quantity, source: str, label: str, hearts: str, compared: str,
    checked: str, ages: tuple[float, float] = ADULTS,
) -> Published:  # fmt: skip
    """Return a value that is published as mean +- sd, whose interval is one sd to both sides."""
    interval = "mean +- sd"
    return Published(
        quantity, source, label, hearts, mean - sd, mean, mean + sd, interval, compared, checked, ages
    )


def single(
    value: float, quantity: Quantity, source: str, label: str, hearts: str, compared: str, checked: str
) -> Published:
    """Return a value that is published without an interval."""
    return Published(quantity, source, label, hearts, value, value, value, "one value", compared, checked)


ABSTRACT: Final = "abstract"
SONG: Final = "Song 2016, J Ultrasound Med"
CHILDREN: Final = "Villemain 2018, JACC Cardiovasc Imaging"
VILLEMAIN: Final = "Villemain 2019, JACC Cardiovasc Imaging"
MALIK: Final = "Malik 2023, J Am Soc Echocardiogr"
CAENEN: Final = "Caenen 2023, Sci Rep"
ELGETI: Final = "Elgeti 2010, J Cardiovasc Magn Reson"
RABBITS_2016: Final = "Vejdani-Jahromi 2016, IEEE Trans Ultrason Ferroelectr Freq Control"
RABBITS_2018: Final = "Vejdani-Jahromi 2018, Ultrasound Med Biol"
COPENHAGEN: Final = "Copenhagen, City Heart Study"
LANG: Final = "Lang 2015, J Am Soc Echocardiogr"
FRAMINGHAM: Final = "Framingham 1992, Am J Cardiol"
OF_VELOCITIES: Final = "of flows, of velocities in persons: the same where the valve opens alike"
SAME: Final = "same quantity"
ANISOTROPY: Final = "same quantity; the model has one speed for all directions"
AMPLITUDES: Final = "other quantity: from amplitudes of waves from outside, by a model of them"
NOT_TOLD: Final = "the abstract does not say which modulus: read here as "
MODULI: Final = {LATE_YOUNG: "Young's", LATE_SHEAR: "shear"}
BY_AGE: Final = (
    ((20.0, 40.0), 2.59, 0.58),
    ((40.0, 60.0), 4.70, 0.88),
    ((60.0, 80.0), 6.08, 1.06),
)
"""Ages, and mean and sd of Villemain 2019 in kPa."""

PUBLISHED: Final = (
    Published(
        LATE_SPEED, SONG, "long axis", "10 healthy adults, septum, long axis", 1.29, np.nan, 1.45,
        "means of basal and middle septum", ANISOTROPY, ABSTRACT,
    ),
    Published(
        LATE_SPEED, SONG, "short axis", "10 healthy adults, septum, short axis", 1.81, np.nan, 1.82,
        "means of middle and basal septum", ANISOTROPY, ABSTRACT,
    ),
    Published(
        LATE_SPEED, CHILDREN, "children",
        "20 healthy children of 5 to 18 years, septum, long axis", 0.87, 1.14, 1.51,
        "least to largest", ANISOTROPY, "abstract, without authors, year and journal", (5.0, 18.0),
    ),
    *(
        mean_and_sd(
            mean, sd, quantity, VILLEMAIN, f"{ages[0]:.0f} to {ages[1] - 1.0:.0f} years",
            "20 healthy adults, septum", f"{NOT_TOLD}{modulus}", ABSTRACT, ages,
        )
        for quantity, modulus in MODULI.items()
        for ages, mean, sd in BY_AGE
    ),
    mean_and_sd(
        1.67, 0.53, LATE_SHEAR, MALIK, "to 45 years", "45 healthy, one month to 45 years, septum",
        "same quantity: kPa and m/s of the neonates are those of a shear modulus", ABSTRACT, (0.0, 45.0),
    ),
    single(5.01, PEAK_SPEED, CAENEN, "pig", "one pig", SAME, "abstract, which lacks this number"),
    single(118.0, PEAK_TIME, CAENEN, "pig", "one pig", SAME, "abstract, which lacks this number"),
    mean_and_sd(
        2.10, 0.47, RATIO, "Jin 2023, Ultrasound Med Biol", "push", "12 healthy adults, septum",
        "other quantity: displacements by one push, diastole over systole", ABSTRACT,
    ),
    mean_and_sd(
        7.12, 3.24, RATIO, RABBITS_2016, "rabbits, speed", "8 isolated hearts of rabbits, speeds",
        SAME, ABSTRACT,
    ),
    mean_and_sd(
        6.01, 1.37, RATIO, RABBITS_2016, "rabbits, push", "8 isolated hearts of rabbits, displacements",
        "other quantity: displacements by one push, diastole over systole", ABSTRACT,
    ),
    mean_and_sd(
        14.0, 11.0, RATIO, "Tzschätzsch 2012, Ultrasound Med Biol", "waves",
        "20 healthy adults, waves of 30 Hz", AMPLITUDES, "abstract, without authors",
    ),
    mean_and_sd(
        37.7, 10.6, RATIO, "Sack 2009, Magn Reson Med", "waves",
        "6 healthy adults, waves of 24 Hz", AMPLITUDES, "abstract, without year and journal",
    ),
    mean_and_sd(
        75.0, 31.0, HALF_RELAXATION, ELGETI, "healthy", "35 healthy adults",
        "other quantity: from the rise of wave amplitudes to that of the cavity", ABSTRACT,
    ),
    mean_and_sd(
        133.0, 57.0, HALF_RELAXATION, ELGETI, "diastolic dysfunction",
        "11 adults with mild diastolic dysfunction",
        "other quantity: from the rise of wave amplitudes to that of the cavity", ABSTRACT,
    ),
    single(
        1.164, DECAY_SLOPE, RABBITS_2018, "rabbits", "11 isolated hearts of rabbits",
        "same quantity, if it is of stiffness on pressure", "abstract, which does not say which on which",
    ),
    single(0.80, DECAY_R, RABBITS_2018, "rabbits", "11 isolated hearts of rabbits", SAME, ABSTRACT),
    mean_and_sd(292.0, 23.0, EJECTION, COPENHAGEN, "healthy", "1,969 healthy adults", SAME, ABSTRACT),
    mean_and_sd(
        40.0, 10.0, CONTRACTION, COPENHAGEN, "healthy", "1,969 healthy adults",
        "same quantity; the model's begins with the first bonds where the valve has closed before", ABSTRACT,
    ),
    mean_and_sd(0.63, 0.05, FRACTION, LANG, "healthy", "healthy adults, both sexes", SAME, "guideline"),
    mean_and_sd(
        2.08, 0.55, FILLING, FRAMINGHAM, "20 to 29 years", "healthy adults", OF_VELOCITIES, ABSTRACT,
        (20.0, 30.0),
    ),
    mean_and_sd(
        0.84, 0.29, FILLING, FRAMINGHAM, "70 to 79 years", "healthy adults", OF_VELOCITIES, ABSTRACT,
        (70.0, 80.0),
    ),
)  # fmt: skip
"""In the order of the table."""
