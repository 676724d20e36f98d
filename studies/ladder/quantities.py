"""What is compared between structures: parameters, the stiffness of the beat, and changes within a person."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from swesbi.base.arrays import FloatArray
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.operator import active_stiffness_map
from swesbi.measurement.speeds import SpeedRecording
from swesbi.parameters import PHI, REPORTED, THETA_NAMES
from swesbi.prior import in_bounds


@dataclass(frozen=True)
class Quantity:
    """One quantity that is compared.

    Attributes:
        name: Name in artefacts and tables.
        unit: Its unit, a reciprocal as a power.
        words: What tables call it.
    """

    name: str
    unit: str
    words: str


CONDITIONAL: Final = "conditional on the structure"
"""What is said of k_0 in kPa wherever the ladder prints it."""
ATTAINED: Final = "attained_kpa"
SHOWN: Final = "shown_kpa"
QUANTITIES: Final = (
    *(
        Quantity(
            p.name,
            p.cf_unit,
            f"{p.text} in kPa, {CONDITIONAL}" if p.name == "k0_kpa" else f"{p.meaning} {p.text}",
        )
        for p in PHI
    ),
    Quantity(ATTAINED, "kPa", "attained stiffness: largest active stiffness of the simulated beat"),
    Quantity(SHOWN, "kPa", "shown stiffness: what elastography sees of it"),
)
"""What each posterior is summarised by, in the order of the last axis of its values."""
QUANTITY_UNITS: Final = ", ".join(quantity.unit for quantity in QUANTITIES)
CHANGE_OF: Final = "change_of_"
CHANGED: Final = ("k0_kpa", "k_sr_per_s", ATTAINED, SHOWN)
"""Quantities whose change within a person is compared: the ratio of a second recording to the first."""
BY_NAME: Final = {quantity.name: quantity for quantity in QUANTITIES}
WORDS: Final = {name: quantity.words for name, quantity in BY_NAME.items()} | {
    f"{CHANGE_OF}{name}": f"change within a person: {re.split(':| in kPa', BY_NAME[name].words)[0]}"
    for name in CHANGED
}
"""What tables call each quantity and each change."""


def quantities_of(model: SpeedModel, phi: FloatArray) -> FloatArray:
    """Return what `QUANTITIES` names, of phi (n, d) under the model's structure; shape (n, 6).

    The beats are simulated. A spring in series with the bonds hides part of their stiffness: what
    elastography shows is less than what they attain.

    Raises:
        ValueError: A simulation has no periodic beat.
    """
    active = model.simulate(phi).active_stiffness_kpa
    if not np.isfinite(active).all():
        failed = int((~np.isfinite(active).all(axis=1)).sum())
        raise ValueError(
            f"subject {model.recording.subject}: {failed} of {len(phi)} draws have no periodic beat, "
            "though they had a likelihood"
        )
    seen = active_stiffness_map(model.settings.measurement.active_stiffness_map)(active)
    return np.column_stack([phi[:, REPORTED], active.max(axis=1), seen.max(axis=1)])


def changed_recording(base: SpeedModel, phi: FloatArray, change: Mapping[str, float]) -> SpeedRecording:
    """Return a second recording of the same person, whose theta has changed by known factors.

    The speeds are those measured, times what the base's equations say of the change at phi; errors,
    discrepancy and all that is not the model are the first recording's own.

    Args:
        base: The first recording under the base's equations.
        phi: The person as the base sees it; shape (d,).
        change: Factors of theta by name.

    Raises:
        ValueError: The changed person lies outside the prior's box, or has no periodic beat.
    """
    changed = phi.copy()
    for name, factor in change.items():
        changed[THETA_NAMES.index(name)] *= factor
    both = np.stack([phi, changed])
    subject = base.recording.subject
    if not in_bounds(both, base.settings.prior).all():
        raise ValueError(
            f"subject {subject}: changed by {dict(change)} it leaves the prior; take milder factors"
        )
    log_speed = base.predict(both).log_speed
    if not np.isfinite(log_speed).all():
        raise ValueError(f"subject {subject}: no periodic beat once theta has changed by {dict(change)}")
    speed = base.recording.speed_m_s * np.exp(log_speed[1] - log_speed[0])
    return replace(base.recording, speed_m_s=speed)
