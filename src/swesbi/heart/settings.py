"""Settings of the forward model: options by name, material, circulation, activation, numerics."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings


class ForwardModelSettings(Settings):
    """Everything that one simulation depends on besides theta and the subject's context.

    Options are named; a value that only an unused option needs may be absent (null).
    """

    geometry: Literal["midwall", "thin"] = Field(
        description="R_0 is the mid-wall radius, or the wall is thin"
    )
    passive_law: Literal["exponential", "mooney_rivlin"]
    active_law: Literal["bcs", "tau_only"] = Field(description="bond kinetics with k_c, or a stress alone")
    stress_measure: Literal["first_piola", "second_piola"] = Field(
        description="tau_c enters as such, or times lambda"
    )
    length_dependence: Literal["none", "frank_starling"] = Field(description="n_0(e)")
    valves: Literal["resistive", "inertance"]
    wall_inertia: bool
    circulation: Literal["closed", "open"] = Field(
        description="pulmonary RC, or prescribed atrial and venous pressure"
    )

    passive_c0_pa: float = Field(gt=0, description="C_0 (exponential) or W_1 (Mooney-Rivlin)")
    passive_c1: float = Field(ge=0)
    passive_c2_pa: float = Field(ge=0, description="C_2 (exponential) or W_2 (Mooney-Rivlin)")
    passive_c3: float = Field(ge=0)
    wall_viscosity_pa_s: float = Field(ge=0, description="eta")
    fibre_viscosity_pa_s: float = Field(ge=0, description="mu")
    sigma_0_pa: float = Field(gt=0, description="active stress of the fully activated fibre")
    destruction_alpha: float = Field(ge=0, description="bonds destroyed per unit of strain")
    wall_density_kg_m3: float | None = Field(default=None, gt=0, description="needed by wall_inertia")

    activation_onset_s: float = Field(ge=0, description="t_on, after the R peak")
    activation_duration_s: float = Field(gt=0, description="D, at the reference period")
    activation_reference_period_s: float = Field(gt=0, description="duration scales with sqrt(T / this)")
    activation_ramp_s: float = Field(gt=0, description="w, the width of the tanh ramps")

    mitral_resistance_pa_s_m3: float = Field(gt=0)
    aortic_resistance_pa_s_m3: float = Field(gt=0)
    mitral_inertance_pa_s2_m3: float | None = Field(
        default=None, gt=0, description="needed by valves: inertance"
    )
    aortic_inertance_pa_s2_m3: float | None = Field(
        default=None, gt=0, description="needed by valves: inertance"
    )
    proximal_resistance_pa_s_m3: float = Field(gt=0, description="R_p")
    proximal_capacitance_m3_pa: float | None = Field(default=None, gt=0, description="null: none")
    distal_resistance_pa_s_m3: float = Field(gt=0, description="R_d")
    systemic_capacitance_m3_pa: float = Field(gt=0, description="C_s")
    pulmonary_resistance_pa_s_m3: float = Field(ge=0, description="R_pul")
    pulmonary_capacitance_m3_pa: float = Field(gt=0, description="C_pul")
    atrial_pressure_pa: float | None = Field(default=None, description="needed by circulation: open")
    venous_pressure_pa: float | None = Field(default=None, description="needed by circulation: open")

    initial_displacement_ratio: float = Field(gt=-0.5, lt=1.0, description="y / R_0 at the start")
    initial_arterial_pressure_pa: float = Field(gt=0)
    initial_pulmonary_pressure_pa: float = Field(gt=0)

    steps_per_beat: int = Field(ge=50, le=100_000)
    maximum_step_s: float = Field(gt=0, description="slow hearts take a multiple of steps_per_beat")
    samples_per_beat: int = Field(ge=10, description="M, points of a returned cycle; divides steps_per_beat")
    periodicity_tolerance: float = Field(
        gt=0, le=1e-2, description="relative change of the state over a beat"
    )
    maximum_beats: int = Field(ge=2, le=10_000)
    extrapolation_memory: int = Field(
        ge=0,
        le=4,
        description="beats that the periodic state is extrapolated from; 0: beat after beat",
    )

    @model_validator(mode="after")
    def _options_have_their_values(self) -> Self:
        needs = {
            "wall_inertia: true": (self.wall_inertia, ("wall_density_kg_m3",)),
            "valves: inertance": (
                self.valves == "inertance",
                ("mitral_inertance_pa_s2_m3", "aortic_inertance_pa_s2_m3"),
            ),
            "circulation: open": (self.circulation == "open", ("atrial_pressure_pa", "venous_pressure_pa")),
        }
        for option, (chosen, names) in needs.items():
            for name in names:
                if chosen and getattr(self, name) is None:
                    raise ValueError(f"forward_model.{name} is missing; {option} needs it")
        if self.steps_per_beat % self.samples_per_beat:
            raise ValueError(
                f"forward_model.samples_per_beat = {self.samples_per_beat} does not divide "
                f"steps_per_beat = {self.steps_per_beat}; choose a divisor"
            )
        return self
