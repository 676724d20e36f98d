"""Hearts of letter e: the spherical heart of PhysioBlocks 2.0.1 (Inria) with its own k_c and circulation.

The program runs in a process of its own, ``program/physioblocks_hearts.py``, which needs `physioblocks`
alone. What differs from its reference heart is told here; everything else is as the program ships it.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from data.other_hearts.drawn import Drawn
from studies.validation.hearts.beat import PHASES, Beat
from studies.validation.hearts.heart import K_SR
from studies.validation.hearts.ranges import log_uniform
from swesbi.context import Context
from swesbi.parameters import K_0, K_ATP, THETA_SI
from swesbi.prior import PriorSettings, sample
from swesbi.virtual.generated import Range

LETTER: Final = "e"
VARIED: Final[Range] = (0.8, 1.25)
"""Of each drawn parameter over its reference value, uniform in its logarithm; chosen: a fifth or so."""
REFERENCE: Final[Mapping[str, float]] = {
    "contractility_pa": 90e3,
    "wall_stiffness": 1.0,
    "atrial_pressure": 1.0,
    "venous_pressure_pa": 1600.0,
    "proximal_resistance_pa_s_m3": 7.0e6,
    "distal_resistance_pa_s_m3": 1.1e8,
    "distal_time_constant_s": 2.0,
    "destruction_per_contraction_rate_s": 12.0 / 35.0,
}
"""What is drawn, and its value in the program's reference heart, of wall and atrium as multiples.

Bonds are destroyed by strain in proportion to how fast they form, as in the reference heart, where 12 goes
with 35 /s: the curve of force and velocity is then as bent at any k_ATP of the prior. At the prior's centre
the reference heart ejects 34 % of its blood with a destruction of 12, and 54 % with 1.5.
"""
REFERENCE_RADIUS_M: Final = 0.0340
REFERENCE_PERIOD_S: Final = 1.0
SIZED: Final = ("proximal_resistance_pa_s_m3", "distal_resistance_pa_s_m3")
"""Of these the reference belongs to the size and rate of the reference heart; see :func:`size_of`."""
WALL_PA: Final = (444.0, 2.9, 69.0, 6.5)  # C_0, C_1, C_2, C_3
ATRIAL_PA: Final = {"min": 450.0, "max": 900.0}


@dataclass(frozen=True)
class PhysioBlocksHearts:
    """Where the hearts come from: the prior of theta, and the running program."""

    prior: PriorSettings
    program: Program

    @property
    def letter(self) -> str:
        """Its letter."""
        return LETTER

    @property
    def settings(self) -> dict[str, Any]:
        """What a heart depends on besides its draws and the population."""
        return {"prior": self.prior.to_plain(), "physioblocks": self.program.version}

    def draw(self, context: Context, rng: np.random.Generator) -> Drawn:
        """Draw theta from the prior, and wall, atrium and circulation about the reference heart's."""
        theta = sample(1, self.prior, rng)[0]
        own = {name: value * log_uniform(VARIED, rng) for name, value in REFERENCE.items()}
        return Drawn(theta, own | {name: own[name] * size_of(context) for name in SIZED})

    def beat(self, context: Context, drawn: Drawn) -> Beat:
        """Return the periodic beat of a heart; a RuntimeError where it has none."""
        return self.program.beat(parameters_of(context, drawn), context.period_s)

    def refusal(self, beat: Beat) -> str:
        """Refuse none: theta keeps the distribution of the prior, whatever beats it makes."""
        return ""


def size_of(context: Context) -> float:
    """Return the resistance over the reference heart's: a smaller or slower heart meets the same pressure."""
    volume = (REFERENCE_RADIUS_M / context.radius_m) ** 3
    return volume * context.period_s / REFERENCE_PERIOD_S


def parameters_of(context: Context, drawn: Drawn) -> dict[str, float | list[float]]:
    """Return the parameters that differ from the reference heart's, by the program's names, in SI units."""
    own, theta = drawn.own, drawn.theta * np.array(THETA_SI)
    c_0, c_1, c_2, c_3 = WALL_PA
    wall = own["wall_stiffness"]
    atrial = {f"atrial.blood_pressure.{name}": own["atrial_pressure"] * pa for name, pa in ATRIAL_PA.items()}
    law = "cavity.rheology.active_law"
    drawn_parameters: dict[str, float | list[float]] = {
        "heart_radius": context.radius_m,
        "heart_thickness": context.thickness_m,
        "heart_rate": context.hr_bpm,
        "heart_contractility": own["contractility_pa"],
        f"{law}.crossbridge_stiffness": float(theta[K_0]),
        f"{law}.destruction_rate": own["destruction_per_contraction_rate_s"] * float(theta[K_ATP]),
        "active_law.activation.max": float(theta[K_ATP]),
        "active_law.activation.min": -float(theta[K_SR]),
        "cavity.dynamics.hyperelastic_cst": [wall * c_0, c_1, wall * c_2, c_3],
        "venous.blood_pressure": own["venous_pressure_pa"],
        "circulation_aorta_proximal.resistance": own["proximal_resistance_pa_s_m3"],
        "circulation_aorta_distal.resistance": own["distal_resistance_pa_s_m3"],
        "circulation_aorta_distal.time_constant": own["distal_time_constant_s"],
    }
    return drawn_parameters | atrial


class Program:
    """The running program; a line of JSON asks for a beat, and a line answers."""

    def __init__(self, command: Sequence[str]) -> None:
        """Start the command: Python of an environment that has `physioblocks`, and the script."""
        self._process = subprocess.Popen(
            list(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )
        self.version = str(self._answer()["physioblocks"])

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End it."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.wait()

    def beat(self, parameters: Mapping[str, object], period_s: float) -> Beat:
        """Return the periodic beat of a heart; a RuntimeError where the program fails on it or finds none."""
        assert self._process.stdin is not None
        question = {"parameters": dict(parameters), "period_s": period_s, "phases": PHASES}
        self._process.stdin.write(json.dumps(question) + "\n")
        self._process.stdin.flush()
        answer = self._answer()
        if "error" in answer:
            raise RuntimeError(f"PhysioBlocks: {answer['error']}")
        return Beat(**{name: np.array(curve) for name, curve in answer.items()})

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise OSError(f"PhysioBlocks ended with status {self._process.wait()}; see what it wrote above")
        answer: dict[str, Any] = json.loads(line)
        return answer
