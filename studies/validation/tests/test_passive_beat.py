"""What a fixed passive part costs where the heart is not the model: it misses k_SR; and known physiology."""

from __future__ import annotations

from pathlib import Path

import pytest

from studies.validation import passive_beat
from studies.validation.passive_beat import infer, inferences, study_settings, summary, table

ROOT = Path(__file__).parents[3]
SUBJECTS = 12


@pytest.mark.slow(minutes=0.2)
def test_the_reference_beat_put_back_misses_k_sr_on_generated_subjects(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without the inference with physiology free, of which nothing is asked here."""
    monkeypatch.setattr(
        passive_beat,
        "inferences",
        lambda model: {name: under for name, under in inferences(model).items() if name != "free"},
    )
    settings, seed = study_settings(ROOT / "config.yaml")
    rows = summary(table(infer(settings, SUBJECTS, seed))).set_index(["inference", "parameter"])
    of_k_sr = rows.xs("k_sr_per_s", level="parameter")
    assert of_k_sr.at["own", "covered"] >= 10
    assert of_k_sr.at["reference", "covered"] <= 7
    assert of_k_sr.at["own", "log_evidence"] > of_k_sr.at["reference", "log_evidence"] + 10.0
