"""Settings of the readings: what each makes otherwise, how they are compared, what stages depend on."""

from __future__ import annotations

from typing import Any, Final, Literal, Self

from pydantic import Field, JsonValue, model_validator

from studies.acquisition_seeds.settings import Seeds, judged_settings
from swesbi.base.settings import Settings
from swesbi.checks.settings import BASE, CurveLossSettings, Cycle
from swesbi.config.read import ConfigError
from swesbi.config.slices import fields_of
from swesbi.config.study import Study

CASES: Final = ("A", "B", "C", "D")
"""Subjects that stand where the paper prints numbers of single cases."""


class Treatment(Settings):
    """What a reading makes otherwise of recordings and curves; as it stands, nothing."""

    noise_factor: float = Field(
        default=1.0, ge=0.0, le=10.0, description="Times the errors that the volunteers were recorded with."
    )
    smoothing_cycle: Cycle = Field(
        default=0.0, description="Sd of the Gaussian kernel, fraction of the cycle; 0: curves as they are."
    )
    smoothed: Literal["features", "recordings"] = Field(
        default="features",
        description="Every curve before S(.), or the recordings alone, before anything else.",
    )
    aligned: bool = Field(
        default=False, description="Trajectory values of curves whose peaks are shifted to one phase."
    )
    curve_noise: bool = Field(
        default=False, description="Noise of maximum and time to peak on the whole curve, before S(.)."
    )
    epoch: Literal["best", "last"] = Field(default="best", description="Whose weights the network has.")
    passive_scale_errors: float = Field(
        default=0.0,
        ge=0.0,
        description="Sd of the passive scale in the predictive check, in standard errors of its calibration.",
    )
    recovery_passive: Literal["reference", "own"] = Field(
        default="reference",
        description="Along which beat the passive stiffness of synthetic recordings runs.",
    )
    recovery_stretch: float = Field(
        default=0.0, ge=0.0, le=0.5, description="By which fraction their cycles are longer after the peak."
    )

    @property
    def same_recordings(self) -> bool:
        """Whether the recordings are those of the study."""
        return self.noise_factor == 1.0 and not (self.smoothing_cycle and self.smoothed == "recordings")

    @property
    def same_features(self) -> bool:
        """Whether S(.) and its noise are those of the study."""
        smoothed = self.smoothing_cycle > 0.0 and self.smoothed == "features"
        return not (smoothed or self.aligned or self.curve_noise)

    @property
    def other_recovery(self) -> bool:
        """Whether synthetic recordings are made otherwise."""
        return self.recovery_passive == "own" or self.recovery_stretch > 0.0


class Reading(Settings):
    """One way in which the paper's text can be meant."""

    label: str = Field(min_length=1, description="What figures and tables call it.")
    changes: dict[str, JsonValue] = Field(
        default={}, description="Keys of the configuration with their other values."
    )
    treatment: Treatment = Field(default=Treatment(), description="What no key of the configuration says.")


class ComparisonSettings(Settings):
    """How a reading's numbers are set against the printed ones.

    The printed numbers stand in report/paper/paper_values.yaml.
    """

    spread_fraction: float = Field(
        gt=0.0, description="Spread of a number that is printed without one, as a fraction of it. Chosen."
    )
    missing_spreads: float = Field(
        gt=0.0,
        description="Spreads by which a number counts as off that a reading does not give. Chosen: no "
        "coverage at all where 0.99 is printed, by the spread above.",
    )
    coverage_margin: float = Field(
        gt=0.0,
        lt=1.0,
        description="By how much a coverage may differ and be given still. Chosen: about one of twenty "
        "phases.",
    )


class WeightsSettings(Settings):
    """CMA-ES under other weights of its loss.

    The paper names the three terms of the loss and not their weights.
    """

    seeds: tuple[int, ...] = Field(
        min_length=1,
        description="Runs of each search; the best is taken. Chosen: three of ten; runs agree in the loss "
        "to four digits.",
    )
    weights: tuple[CurveLossSettings, ...] = Field(
        min_length=1,
        description="Weights of the three terms. Chosen: each term alone, in pairs, and from a hundredth "
        "to a hundred times the first.",
    )
    readings: tuple[str, ...] = Field(
        min_length=1,
        description="Readings on whose recordings the fits are. Chosen: the study's own recordings, and "
        "quieter ones.",
    )


class ReadingsSettings(Settings):
    """The readings, and what is made of them: the section ``readings`` of config.yaml.

    They read otherwise what the paper's text leaves open, on the study's simulations; README.md says how.
    """

    experiment: str = Field(min_length=1, description="An experiment of kind features.")
    comparison: ComparisonSettings = Field(description="How numbers are set against the printed ones.")
    cmaes: WeightsSettings = Field(description="Fits under other weights.")
    acquisition_seeds: tuple[str, ...] = Field(
        description="Readings whose verdicts are asked for under every acquisition seed: what the "
        "landmarks of S(.) do to verdicts."
    )
    seeds: Seeds
    readings: dict[str, Reading] = Field(
        min_length=2,
        description="Readings by name; `base`, as configured, among them. Every value is chosen: the "
        "question is what comes of it.",
    )

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        base = self.readings.get(BASE)
        if base is None or base.changes or base.treatment != Treatment():
            raise ValueError(f"readings needs the reading {BASE!r}, with no changes and no treatment")
        named = {"cmaes.readings": self.cmaes.readings, "acquisition_seeds": self.acquisition_seeds}
        for key, names in named.items():
            if unknown := [name for name in names if name not in self.readings]:
                raise ValueError(f"{key} names the reading {unknown[0]!r}; known: {', '.join(self.readings)}")
        treated = [n for n in self.acquisition_seeds if self.readings[n].treatment != Treatment()]
        if treated:
            raise ValueError(
                f"acquisition_seeds names {treated[0]!r}, which treats recordings or curves; only readings "
                "that change the configuration alone are recorded anew under every seed"
            )
        return self


SIMULATED: Final = "prior forward_model"
"""What the simulations of an experiment depend on, beside its subjects."""
RECORDED: Final = "forward_model measurement passive recording passive_reference_prior=reference_prior"
"""What recordings are read and calibrated with."""
CHAIN: Final = (
    f"{RECORDED} prior experiment.simulations_per_subject experiment.summary "
    "experiment.observation_model experiment.estimator experiment.epoch_study.checkpoint_epochs "
    "experiment.support experiment.posterior experiment.predictive experiment.recovery"
)
"""What the paper's chain depends on."""


def run_settings(study: Study, readings: ReadingsSettings, name: str) -> dict[str, Any]:
    """Return what one reading depends on.

    Raises:
        ConfigError: The experiment has no noise on features, the changed configuration is not valid, or the
            reading changes what the simulations of the study are made with.
    """
    if readings.experiment not in study.config.feature_experiments:
        known = ", ".join(study.config.feature_experiments) or "none"
        raise ConfigError(
            f"readings.experiment = {readings.experiment!r} is no experiment of kind features; known: {known}"
        )
    reading, chosen = readings.readings[name], {"experiment": readings.experiment}
    changed = study.with_changes(reading.changes, f"readings.readings.{name}.changes")
    if fields_of(changed, chosen, SIMULATED) != fields_of(study, chosen, SIMULATED):
        raise ConfigError(
            f"readings.readings.{name}.changes: changes the prior or the forward model; readings are run on "
            "the study's simulations, so make it an experiment of its own"
        )
    treatment = reading.treatment.to_plain()
    chain = fields_of(changed, chosen, CHAIN)
    return {"chain": chain, "treatment": treatment, "changed": bool(reading.changes)}


def seeds_settings(study: Study, readings: ReadingsSettings, name: str) -> dict[str, Any]:
    """Return what the verdicts of one reading under every acquisition seed depend on.

    Raises:
        As ``run_settings``.
    """
    run = run_settings(study, readings, name)
    changed = study.with_changes(readings.readings[name].changes, f"readings.readings.{name}.changes")
    return {"run": run, "judged": judged_settings(changed, readings.experiment, readings.seeds)}


def cmaes_settings(study: Study, readings: ReadingsSettings, name: str) -> dict[str, Any]:
    """Return what the fits on recordings of one reading under other weights depend on."""
    own = {"weights": readings.cmaes.to_plain(), "treatment": readings.readings[name].treatment.to_plain()}
    searched = fields_of(study, {}, "cmaes.search prior=prior_of_cmaes")
    return own | searched | {"protocol": fields_of(study, {}, RECORDED)}


def table_settings(study: Study, readings: ReadingsSettings) -> dict[str, Any]:
    """Return what tables and figure depend on."""
    shown = {"cohort_title": study.config.cohort_title, "comparison": readings.comparison.to_plain()}
    return shown | {"readings": {name: reading.to_plain() for name, reading in readings.readings.items()}}
