"""Sensitivity: shifts in widths of the base's interval, variants as changes of the configuration."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from study_copy import ROOT

from studies.sensitivity import stages
from studies.sensitivity.settings import SensitivitySettings, run_settings, table_settings
from studies.sensitivity.variants import VariantPosterior, VariantPosteriors, sensitivity_table
from swesbi.artefacts import Provenance
from swesbi.config.read import ConfigError, parse_section, read_merged, read_yaml
from swesbi.config.study import load_study
from swesbi.study.job import run_stage, typed_settings

FOLDER = Path(__file__).parents[1]
SECTION = read_yaml(FOLDER / "config.yaml")["sensitivity"]
SENSITIVITY = parse_section(SECTION, "sensitivity", SensitivitySettings)
SHIPPED = read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")}
STUDY = load_study(SHIPPED)
FILES = {"table": ".csv", "figure_pdf": ".pdf", "figure_png": ".png"}
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
    VariantPosteriors(parts).write(tmp_path / "x.h5", Provenance("", "", 1, {}, "0" * 16))
    found = VariantPosteriors.read(tmp_path / "x.h5").of
    assert [(part.subject, part.sampler, part.converged) for part in found] == [
        ("A", "importance", True),
        ("B", "mcmc", True),
    ]
    np.testing.assert_array_equal(found[1].phi, parts[1].phi)


def settings_of(variant: str) -> dict[str, Any]:
    """What the posteriors under a variant depend on, beside its name."""
    settings = run_settings(STUDY, SENSITIVITY, variant)
    assert settings.pop("variant") == variant
    return settings


def test_a_variant_changes_what_it_names_and_nothing_else() -> None:
    base = settings_of("base")
    base["estimator"]["epochs"] = SENSITIVITY.short_training_epochs
    doubled = settings_of("discrepancy_doubled")
    shipped = base["model"]["discrepancy"]
    assert doubled["model"]["discrepancy"] == {name: 2 * value for name, value in shipped.items()}
    doubled["model"]["discrepancy"] = shipped
    assert doubled == base
    assert settings_of("seed_3")["variant_seed"] != base["variant_seed"]


@pytest.mark.parametrize("variant", sorted(SENSITIVITY.variants))
def test_every_variant_is_a_valid_configuration(variant: str) -> None:
    assert (settings_of(variant) == settings_of("base")) == (variant == "base")
    settings = run_settings(STUDY, SENSITIVITY, variant)
    assert typed_settings(stages.sensitivity_run, settings).keys() == settings.keys()


def test_a_wrong_variant_is_refused_by_its_key() -> None:
    def changed(**values: object) -> SensitivitySettings:
        return parse_section(SECTION | values, "sensitivity", SensitivitySettings)

    wrong = {"label": "x", "changes": {"passive": {"exponent_b": -1.0}}}
    with pytest.raises(ConfigError, match=r"variants\.x\.changes: 1 problem.*\n.*passive\.exponent_b = -1"):
        run_settings(STUDY, changed(variants=SECTION["variants"] | {"x": wrong}), "x")
    with pytest.raises(ConfigError, match="needs the variant 'base'"):
        changed(variants={"a": {"label": "a", "changes": {}}, "b": {"label": "b", "changes": {}}})
    with pytest.raises(ConfigError, match="sensitivity.experiment = 'paper' is no experiment of kind speeds"):
        run_settings(STUDY, changed(experiment="paper"), "base")


def test_the_stage_writes_table_and_figure(tmp_path: Path) -> None:
    variants = {"base": posterior(10.0, 2.0), "other": posterior(10.9, 4.0)}
    for name, part in variants.items():
        VariantPosteriors((part,)).write(tmp_path / f"{name}.h5", Provenance("", "", 1, {}, "0" * 16))
    files = {name: [tmp_path / f"sensitivity{ending}"] for name, ending in FILES.items()}
    params = table_settings(STUDY, SENSITIVITY) | {"labels": {"base": "as configured", "other": "another"}}
    params |= {"seed": 1, "subject": "", "code": "0"}
    inputs = {"variants": [tmp_path / "other.h5", tmp_path / "base.h5"]}
    run_stage(stages.sensitivity, inputs, files, params)
    assert pd.read_csv(files["table"][0])["variant"].unique().tolist() == ["base", "other"]
    assert all(path.stat().st_size > 100 for (path,) in files.values())
