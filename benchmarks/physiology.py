"""What physiology by simulation costs, and its error of the active stiffness, on one core.

python benchmarks/physiology.py
python benchmarks/physiology.py --draws 1024 --repeats 21 --subject F
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import Final

import numpy as np
from cases import CONVERGED, Array, load_cases, stiffness_errors, with_numerics

from swesbi.context import Context
from swesbi.heart.physiology import Physiology
from swesbi.heart.settings import ForwardModelSettings
from swesbi.heart.simulate import simulate, simulate_active
from swesbi.seeds import generator

# Log standard deviations about the settings' own values, as wide as a study would draw them.
LOG_SD: Final = {
    "activation_onset_s": 0.22,
    "activation_duration_s": 0.05,
    "activation_ramp_s": 0.35,
    "destruction_alpha": 0.35,
    "sigma_0_pa": 0.10,
    "passive_wall_factor": 0.25,
    "distal_resistance_pa_s_m3": 0.15,
    "systemic_capacitance_m3_pa": 0.20,
}


def drawn(settings: ForwardModelSettings, n: int, seed: int) -> Physiology:
    """Draw log-normal physiology of n simulations about the settings' own."""
    own = Physiology.of_settings(settings, n)
    rng = generator(seed, "physiology benchmark")
    factors = {name: np.exp(sd * rng.standard_normal(n)) for name, sd in LOG_SD.items()}
    return replace(own, **{name: getattr(own, name) * factor for name, factor in factors.items()})


def interleaved_s(
    theta: Array,
    context: Context,
    settings: ForwardModelSettings,
    cases: dict[str, Physiology | None],
    repeats: int,
) -> dict[str, Array]:
    """Return processor times (repeats,) of each case, one case after the other in every repeat."""
    times: dict[str, list[float]] = {name: [] for name in cases}
    for repeat in range(repeats + 1):
        for name, physiology in cases.items():
            begin = time.process_time()
            simulate_active(theta, context, settings, physiology)
            if repeat > 0:  # the first compiles
                times[name].append(time.process_time() - begin)
    return {name: np.array(values) for name, values in times.items()}


def main() -> None:
    """Time the cases, compare them with converged beats and print a line for each."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--draws", type=int, default=1024, help="simulations a call")
    parser.add_argument("--repeats", type=int, default=21, help="interleaved repeats")
    parser.add_argument("--subject", default="A", help="virtual volunteer whose context is simulated")
    arguments = parser.parse_args()
    study = load_cases(arguments.draws)
    contexts = {context.subject: context for context in study.contexts}
    context, settings, theta = contexts[arguments.subject], study.settings, study.theta
    exact_settings = with_numerics(settings, **CONVERGED)
    cases: dict[str, Physiology | None] = {
        "shared by all simulations": None,
        "by simulation, the settings' own": Physiology.of_settings(settings, arguments.draws),
        "by simulation, drawn": drawn(settings, arguments.draws, seed=1),
    }
    times = interleaved_s(theta, context, settings, cases, arguments.repeats)
    shared = times["shared by all simulations"]
    print(f"{arguments.draws} prior draws, context of {arguments.subject}, {arguments.repeats} repeats")
    print(
        f"{'physiology':34s}{'us/simulation':>14s}{'ratio':>8s}{'beats':>8s}{'error 95 %':>12s}{'worst':>10s}"
    )
    for name, physiology in cases.items():
        beats = simulate(theta, context, settings, physiology)
        errors = stiffness_errors(beats, simulate(theta, context, exact_settings, physiology))
        cost = f"{1e6 * np.median(times[name]) / arguments.draws:14.1f}{np.median(times[name] / shared):8.2f}"
        error = f"{np.percentile(errors, 95):12.1e}{errors.max():10.1e}"
        print(f"{name:34s}{cost}{beats.beats.mean():8.2f}{error}")
    print("processor time of one core, medians; ratio: median over the repeats, each case after the other")
    print("error: of k_c over the beat, relative to its peak, against 6400 steps and 1e-10 of change a beat")


if __name__ == "__main__":
    main()
