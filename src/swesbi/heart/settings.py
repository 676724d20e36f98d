"""Settings of the forward model: options by name, material, circulation, activation, numerics."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from swesbi.base.settings import Settings


class ForwardModelSettings(Settings):
    """Everything that one simulation depends on besides theta and the subject's context.

    Options are named; a value that only an unused option needs may be absent (null).

    Geometry, passive law and active law: Caruel et al. 2014 (Biomech Model Mechanobiol 13:897),
    Chapelle et al. 2012 (Int J Multiscale Comput Eng 10:189). Values of PhysioBlocks 2.0.1 are those of
    its human heart (Inria). Activation begins at the R peak.
    """

    geometry: Literal["midwall", "thin"] = Field(
        description="R_0 is the mid-wall radius, or the wall is thin."
    )
    passive_law: Literal["exponential", "mooney_rivlin"] = Field(
        description="Law of the passive wall, exponential in its invariants or Mooney-Rivlin."
    )
    active_law: Literal["bcs", "tau_only"] = Field(
        description="Law of the active fibre. bcs: bond kinetics with k_c and tau_c. tau_only: a stress "
        "alone."
    )
    stress_measure: Literal["first_piola", "second_piola"] = Field(
        description="Stress tau_c enters as such (first Piola), or times lambda (second Piola)."
    )
    length_dependence: float = Field(
        ge=0,
        le=1,
        description="Share gamma of the dependence n_0(e) of the bonds on length that PhysioBlocks' human "
        "heart has. Without it, at 0, k_0 and k_ATP compensate as in the paper.",
        json_schema_extra={"unit": "1"},
    )
    valves: Literal["resistive", "inertance"] = Field(
        description="Flow through the valves. resistive: closed form. inertance: with inertia of the blood."
    )
    wall_inertia: bool = Field(
        description="Whether the wall has inertia. It is below 1 % of the pressure. The virtual "
        "volunteers have it."
    )
    circulation: Literal["closed", "open"] = Field(
        description="Circulation: pulmonary RC (closed, as in the paper), or prescribed atrial and venous "
        "pressure (open)."
    )

    passive_c0_pa: float = Field(
        gt=0,
        description="C_0 (exponential) or W_1 (Mooney-Rivlin). Three times the 444 Pa of PhysioBlocks "
        "2.0.1. Tripled by choice, for volumes at the prior centre.",
    )
    passive_c1: float = Field(ge=0, description="C_1, exponent of the exponential law. PhysioBlocks 2.0.1.")
    passive_c2_pa: float = Field(
        ge=0,
        description="C_2 (exponential) or W_2 (Mooney-Rivlin). Three times the 69 Pa of PhysioBlocks "
        "2.0.1, tripled like C_0.",
    )
    passive_c3: float = Field(ge=0, description="C_3, exponent of the exponential law. PhysioBlocks 2.0.1.")
    wall_viscosity_pa_s: float = Field(ge=0, description="eta, viscosity of the wall. PhysioBlocks 2.0.1.")
    fibre_viscosity_pa_s: float = Field(ge=0, description="mu, viscosity of the fibre. PhysioBlocks 2.0.1.")
    sigma_0_pa: float = Field(
        gt=0,
        description="Active stress of the fully activated fibre, which sets the systolic pressure. "
        "PhysioBlocks 2.0.1.",
    )
    destruction_alpha: float = Field(
        ge=0,
        description="Bonds destroyed per unit of strain. Chosen: ejection fraction and time to peak at "
        "the prior centre.",
    )
    wall_density_kg_m3: float | None = Field(
        default=None,
        gt=0,
        description="Density of the wall, needed by wall_inertia. The paper's tissue density.",
    )

    activation_onset_s: float = Field(
        ge=0,
        description="t_on, onset of activation after the R peak. Chosen: electromechanical delay of the "
        "septum.",
    )
    activation_duration_s: float = Field(
        gt=0,
        description="D, duration of activation at the reference period. Chosen: QT-like duration at a "
        "period of 0.8 s.",
    )
    activation_reference_period_s: float = Field(
        gt=0,
        description="Period at which the duration holds. It scales with the square root of the period "
        "over this (Bazett's rule). Chosen.",
    )
    activation_ramp_s: float = Field(
        gt=0, description="w, width of the tanh ramps. Chosen: time of calcium rise."
    )

    mitral_resistance_pa_s_m3: float = Field(
        gt=0, description="Resistance of the open mitral valve. PhysioBlocks 2.0.1: conductance 9e-6 m3/s/Pa."
    )
    aortic_resistance_pa_s_m3: float = Field(
        gt=0,
        description="Resistance of the open aortic valve. PhysioBlocks 2.0.1: conductance 1.3e-5 m3/s/Pa.",
    )
    mitral_inertance_pa_s2_m3: float | None = Field(
        default=None,
        gt=0,
        description="Inertance of the mitral valve, needed by valves: inertance. PhysioBlocks 2.0.1.",
    )
    aortic_inertance_pa_s2_m3: float | None = Field(
        default=None,
        gt=0,
        description="Inertance of the aortic valve, needed by valves: inertance. PhysioBlocks 2.0.1.",
    )
    proximal_resistance_pa_s_m3: float = Field(
        gt=0, description="R_p, proximal resistance. PhysioBlocks 2.0.1."
    )
    proximal_capacitance_m3_pa: float | None = Field(
        default=None, gt=0, description="Proximal capacitance; null: none. PhysioBlocks 2.0.1 has 2e-10."
    )
    distal_resistance_pa_s_m3: float = Field(
        gt=0, description="R_d, distal resistance. Chosen: mean arterial pressure of a healthy adult."
    )
    systemic_capacitance_m3_pa: float = Field(
        gt=0, description="C_s, systemic capacitance. Chosen: arterial pulse pressure of a healthy adult."
    )
    pulmonary_resistance_pa_s_m3: float = Field(
        ge=0, description="R_pul, pulmonary resistance. Chosen: a fifteenth of the systemic one."
    )
    pulmonary_capacitance_m3_pa: float = Field(
        gt=0, description="C_pul, pulmonary capacitance. Chosen: venous side an order above the arterial one."
    )
    atrial_pressure_pa: float | None = Field(
        default=None, description="Atrial pressure, needed by circulation: open."
    )
    venous_pressure_pa: float | None = Field(
        default=None, description="Venous pressure, needed by circulation: open."
    )

    atrial_kick_pa: float = Field(
        default=0.0,
        ge=0,
        description="P_a, by how much atrial contraction raises the atrial pressure. 0, as in the paper: "
        "atria do not contract.",
    )
    atrial_delay_s: float = Field(
        default=0.13,
        ge=0,
        le=0.26,
        description="Start of atrial contraction, from 0.26 s before the R peak. P wave and tissue Doppler: "
        "its middle 60 ms before the R peak.",
    )

    initial_displacement_ratio: float = Field(
        gt=-0.5,
        lt=1.0,
        description="Displacement y / R_0 at the start. In the closed loop the start sets the stressed "
        "volume, and with it the preload. Chosen: end-diastolic volumes near the measured LVEDV.",
    )
    initial_arterial_pressure_pa: float = Field(
        gt=0, description="Arterial pressure at the start. Chosen: mean arterial pressure."
    )
    initial_pulmonary_pressure_pa: float = Field(
        gt=0, description="Pulmonary pressure at the start. Chosen: mean atrial pressure."
    )

    steps_per_beat: int = Field(ge=50, le=100_000, description="Steps of a beat. Chosen.")
    maximum_step_s: float = Field(
        gt=0,
        description="Longest step; slow hearts take a multiple of steps_per_beat. Chosen: stability where "
        "the wall is stiffest.",
    )
    samples_per_beat: int = Field(
        ge=10, description="M, points of a returned cycle; divides steps_per_beat. Chosen."
    )
    periodicity_tolerance: float = Field(
        gt=0,
        le=1e-2,
        description="Relative change of volume, pressures, stiffness and stress over a beat. Chosen.",
    )
    maximum_beats: int = Field(
        ge=2, le=10_000, description="Beats after which a simulation that is not periodic has failed. Chosen."
    )
    extrapolation_memory: int = Field(
        ge=0,
        le=4,
        description="Beats of Anderson's extrapolation of the periodic state. 0 runs beat after beat, to "
        "the same state. Chosen.",
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
