"""The shipped settings of the forward model and the six contexts, for its tests."""

from __future__ import annotations

from pathlib import Path

import yaml

from swesbi.context import Context
from swesbi.forward_model import ForwardModelSettings

CONFIG = Path(__file__).parents[1] / "config.yaml"
SETTINGS = ForwardModelSettings.from_plain(yaml.safe_load(CONFIG.read_text())["forward_model"])
COHORT = {
    "A": Context("A", "M", 24, 1.88, 57, 118, 45, 0.88),
    "B": Context("B", "F", 27, 1.68, 64, 84, 31, 0.74),
    "C": Context("C", "M", 21, 1.94, 69, 112, 42, 0.90),
    "D": Context("D", "F", 19, 1.62, 78, 78, 28, 0.70),
    "E": Context("E", "M", 22, 1.80, 72, 99, 37, 0.78),
    "F": Context("F", "F", 20, 1.55, 84, 68, 24, 0.64),
}
