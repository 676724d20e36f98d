"""Settings of the ladder: its structures, the grid of the discrepancy, the change within a person."""

from __future__ import annotations

from typing import Any, Self

from pydantic import Field, JsonValue, model_validator

from swesbi.base.settings import Settings
from swesbi.checks.settings import BASE, Cycle, Fraction
from swesbi.config.read import ConfigError
from swesbi.config.slices import fields_of
from swesbi.config.study import Study
from swesbi.measurement.settings import DiscrepancySettings
from swesbi.parameters import THETA_NAMES


class Structure(Settings):
    """Other equations, or other fixed values in them: ``changes`` to the configuration."""

    label: str = Field(min_length=1, description="What figures and tables call it.")
    changes: dict[str, JsonValue] = Field(description="Keys of the configuration with their other values.")


class LadderEffort(Settings):
    """What is inferred under each structure, and the effort put into it.

    The grid is of delta and tau, chosen anew under each structure by the evidence of the whole cohort.
    Results at the shipped pair stand beside.
    """

    speed_fractions: tuple[Fraction, ...] = Field(
        min_length=1, description="Grid of delta. Chosen: from a quarter to twice of what is shipped."
    )
    timing_cycles: tuple[Cycle, ...] = Field(min_length=1, description="Grid of tau. Chosen.")
    simulations_per_round: int = Field(
        ge=100, description="Simulations that each proposal adds to a bank. Chosen."
    )
    max_rounds: int = Field(ge=2, description="Proposals of a bank at most. Chosen.")
    min_effective_draws: int = Field(
        ge=10,
        description="Effective sample size at which a pair is done. Chosen: log evidence of a subject and "
        "pair to 0.05.",
    )
    change: dict[str, float] = Field(
        min_length=1,
        description="Factors of theta by which a second recording of each person is made, by the "
        "equations as configured. It asks what of a change within a person every structure sees. Chosen: "
        "a stronger and stiffer heart, within what exercise or a drug does.",
    )

    @model_validator(mode="after")
    def _check_change(self) -> Self:
        for name, factor in self.change.items():
            if name not in THETA_NAMES or factor <= 0.0:
                raise ValueError(
                    f"change.{name} = {factor}: needs one of {', '.join(THETA_NAMES)} and a factor above 0"
                )
        return self

    def pairs(self, shipped: DiscrepancySettings) -> tuple[DiscrepancySettings, ...]:
        """Return the shipped pair (delta, tau) first, then every other of the grid, tau running fastest."""
        grid = (
            DiscrepancySettings(speed_fraction=delta, timing_cycle=tau)
            for delta in self.speed_fractions
            for tau in self.timing_cycles
        )
        return (shipped, *(pair for pair in grid if pair != shipped))


class LadderSettings(LadderEffort):
    """The ladder of structures: the section ``ladder`` of config.yaml."""

    experiment: str = Field(min_length=1, description="Its network gives first proposals.")
    survives_widths: float = Field(
        gt=0.0,
        description="A quantity survives that no structure moves by as many widths of its interval. "
        "Chosen: half a width of the base's interval, as the figure of studies/sensitivity shades.",
    )
    structures: dict[str, Structure] = Field(
        min_length=2,
        description="Structures by name; `base`, without changes, among them. `alpha_4` has 2.7 times the "
        "centre, and bounds at four standard deviations. Every value of `physiological_timing` is by "
        "physiological_timing.py: CMA-ES over 20 contexts, seed 1, at the prior's centre. Its priors have "
        "these centres, widths as configured, and bounds at four standard deviations or at the declared "
        "range. README.md has what it reaches.",
    )

    @model_validator(mode="after")
    def _check_base(self) -> Self:
        if (base := self.structures.get(BASE)) is None or base.changes:
            raise ValueError(f"structures needs the structure {BASE!r}, with `changes: {{}}`")
        return self

    @property
    def effort(self) -> LadderEffort:
        """What one structure's inference depends on."""
        return LadderEffort(**{name: getattr(self, name) for name in LadderEffort.model_fields})


def run_settings(study: Study, ladder: LadderSettings, structure: str) -> dict[str, Any]:
    """Return what the posteriors under one structure depend on: the changed model, and the study's own.

    Raises:
        ConfigError: The experiment has no exact likelihood, or the changed configuration is not valid.
    """
    config, chosen = study.config, {"experiment": ladder.experiment}
    if config.base_of(ladder.experiment) not in config.speed_experiments:
        known = ", ".join((*config.speed_experiments, *config.population_experiments)) or "none"
        raise ConfigError(
            f"ladder.experiment = {ladder.experiment!r} is neither of kind speeds nor over a population; "
            f"known: {known}"
        )
    changed = study.with_changes(
        ladder.structures[structure].changes, f"ladder.structures.{structure}.changes"
    )
    own = fields_of(study, chosen, "base=model experiment.exact")
    return own | fields_of(changed, chosen, "model") | {"effort": ladder.effort.to_plain()}


def table_settings(study: Study, ladder: LadderSettings) -> dict[str, Any]:
    """Return what tables and figure depend on."""
    labels = {name: structure.label for name, structure in ladder.structures.items()}
    shown = fields_of(study, {"experiment": ladder.experiment}, "cohort_title experiment.exact.interval")
    return shown | {"survives_widths": ladder.survives_widths, "labels": labels}
