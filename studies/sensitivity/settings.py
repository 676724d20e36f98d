"""Settings of the sensitivity: variants of one experiment, each a choice made otherwise."""

from __future__ import annotations

from typing import Any, Final, Self

from pydantic import Field, JsonValue, model_validator

from studies.section import check_experiment
from swesbi.base.settings import Settings
from swesbi.checks.settings import BASE
from swesbi.config.experiments import Name
from swesbi.config.study import Study
from swesbi.config.view import View

RUN: Final = ("model", "summary", "estimator", "exact", "simulations_per_subject")
"""What the posteriors of a variant depend on in the configuration, beside its seed."""


class Variant(Settings):
    """One choice made otherwise; ``changes`` lie over the configuration as another file would."""

    label: str = Field(min_length=1, description="What figures and tables call it.")
    changes: dict[str, JsonValue] = Field(description="Keys of the configuration with their other values.")
    full_training: bool = Field(
        default=False,
        description="Train as long as the experiment does; else short, since exact weights make good for it.",
    )
    fix_passive_scale: bool = Field(
        default=False,
        description="Take the passive scale calibrated beforehand, as the paper does, for granted.",
    )


class SensitivitySettings(Settings):
    """Variants of one experiment, each rerun with a choice made otherwise: the section of config.yaml."""

    experiment: Name = Field(description="An experiment of kind speeds.")
    short_training_epochs: int = Field(
        ge=1,
        description="Epochs of the variants without `full_training`. Chosen: less efficient weights, the "
        "same posterior.",
    )
    variants: dict[Name, Variant] = Field(
        min_length=2,
        description="Variants by name; `base`, without changes, among them. `late_window` moves the "
        "network's baseline feature; the exact posterior takes no window. `wider_prior` has bounds and "
        "widths of `wide`.",
    )

    @model_validator(mode="after")
    def _check_base(self) -> Self:
        if (base := self.variants.get(BASE)) is None or base.changes or base.fix_passive_scale:
            raise ValueError(f"variants needs the variant {BASE!r}, with `changes: {{}}`")
        return self


def run_settings(study: Study, sensitivity: SensitivitySettings, variant: str) -> dict[str, Any]:
    """Return what the posteriors under one variant depend on: the changed configuration."""
    check_experiment("sensitivity", sensitivity.experiment, study.config.speed_experiments, "of kind speeds")
    choice = sensitivity.variants[variant]
    changed = study.with_changes(choice.changes, f"sensitivity.variants.{variant}.changes")
    own = View(changed, {"experiment": sensitivity.experiment}).together(*RUN)
    if not choice.full_training:
        own["estimator"]["epochs"] = sensitivity.short_training_epochs
    held = choice.fix_passive_scale
    return own | {"variant": variant, "variant_seed": changed.config.seed, "fix_passive_scale": held}


def table_settings(study: Study, sensitivity: SensitivitySettings) -> dict[str, Any]:
    """Return what table and figure depend on."""
    labels = {name: variant.label for name, variant in sensitivity.variants.items()}
    shown = View(study, {"experiment": sensitivity.experiment}).together("cohort_title", "interval")
    return shown | {"labels": labels}
