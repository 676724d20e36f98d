"""Sensitivity: shifts in widths of the base's interval, variants as changes of the configuration."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from study_copy import ROOT

from swesbi.artefacts import Provenance, save
from swesbi.checks.sensitivity import KIND, VariantPosterior, read_posteriors, sensitivity_table, to_dataset
from swesbi.config.read import ConfigError, read_yaml
from swesbi.config.slices import stage_settings
from swesbi.config.study import load_study

SHIPPED = read_yaml(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
LEVELS = np.linspace(0.0, 1.0, 2001)


def posterior(
    centre: float, width: float, subject: str = "A", sampler: str = "importance"
) -> VariantPosterior:
    """A uniform posterior: every parameter between centre - width/2 and centre + width/2."""
    phi = np.repeat((centre + width * (LEVELS - 0.5))[:, None], 4, axis=1)
    return VariantPosterior(subject, phi, sampler == "mcmc", 0.1, 0.8, converged=True)


def test_a_shift_is_measured_in_widths_of_the_base_s_interval() -> None:
    table = sensitivity_table(
        {"base": [posterior(10.0, 2.0)], "other": [posterior(10.9, 4.0)]},
        {"base": "as configured", "other": "another"},
        0.9,
    )
    base, other = table[table["variant"] == "base"], table[table["variant"] == "other"]
    np.testing.assert_allclose(base["shift_in_widths"], 0.0)
    np.testing.assert_allclose(base["width_ratio"], 1.0)
    np.testing.assert_allclose(other["shift_in_widths"], 0.9 / 1.8)
    np.testing.assert_allclose(other["width_ratio"], 2.0)
    assert list(table["parameter"][:3]) == ["k0_kpa", "k_atp_per_s", "k_sr_per_s"]


def test_posteriors_are_read_back(tmp_path: Path) -> None:
    parts = (posterior(10.0, 2.0, "A"), posterior(20.0, 1.0, "B", "mcmc"))
    save(tmp_path / "x.h5", to_dataset(parts), Provenance(KIND, "", 1, {}, "0" * 16))
    found = read_posteriors(tmp_path / "x.h5")
    assert [(part.subject, part.sampler, part.converged) for part in found] == [
        ("A", "importance", True),
        ("B", "mcmc", True),
    ]
    np.testing.assert_array_equal(found[1].phi, parts[1].phi)


def test_a_variant_changes_what_it_names_and_nothing_else() -> None:
    study = load_study(SHIPPED)
    base = stage_settings(study, "sensitivity_run", variant="base")
    base["train"]["estimator"]["epochs"] = study.config.sensitivity.short_training_epochs
    doubled = stage_settings(study, "sensitivity_run", variant="discrepancy_doubled")
    shipped = base["train"]["model"]["discrepancy"]
    assert doubled["train"]["model"]["discrepancy"] == {name: 2 * value for name, value in shipped.items()}
    doubled["train"]["model"]["discrepancy"] = shipped
    assert doubled == base
    assert stage_settings(study, "sensitivity_run", variant="seed_3")["seed"] != base["seed"]


@pytest.mark.parametrize("variant", sorted(SHIPPED["sensitivity"]["variants"]))
def test_every_variant_is_a_valid_configuration(variant: str) -> None:
    settings = stage_settings(load_study(SHIPPED), "sensitivity_run", variant=variant)
    base = stage_settings(load_study(SHIPPED), "sensitivity_run", variant="base")
    assert (settings == base) == (variant == "base")


def test_a_variant_that_is_none_is_refused_by_its_key() -> None:
    raw = load_study(SHIPPED)
    with pytest.raises(ConfigError, match=r"variants\.x\.changes: 1 problem.*\n.*passive\.exponent_b = -1"):
        raw.with_changes({"passive": {"exponent_b": -1.0}}, "sensitivity.variants.x.changes")
    with pytest.raises(ConfigError, match="needs the variant 'base'"):
        variants = {"a": {"label": "a", "changes": {}}, "b": {"label": "b", "changes": {}}}
        load_study(SHIPPED | {"sensitivity": SHIPPED["sensitivity"] | {"variants": variants}})
