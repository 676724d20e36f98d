"""The physics of the page: heart, measurement, likelihood and weights, translated from this package."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from explorer.translation import syntax
from explorer.translation.program import Loop, Program
from explorer.translation.values import literal
from swesbi.heart.model import options_of
from swesbi.measurement.likelihood import SpeedModelSettings
from swesbi.posterior.settings import ExactSettings, asking
from swesbi.verdict.settings import RuleSettings

KERNEL_RANKS: Final = {"x": 2, "own": 2, "drives": 2, "record": 3, "activation": 2, "rows": 2}
ACTIVATION_RANKS: Final = {"curves": 2, "onset_s": 1, "duration_s": 1, "ramp_s": 1}
EQUATIONS: Final[syntax.Chain] = ("swesbi.heart.kernel", "beat_kernel")
ACTIVATIONS: Final[syntax.Chain] = ("swesbi.heart.activation", "_activation_kernel")
OF_PUSHES: Final = (
    "CellData",
    "CellErrors",
    "cell_innovations",
    "cell_sums",
    "error_factors",
    "likeliest_factor",
)
OWN: Final[Mapping[syntax.Chain, str]] = {
    ("swesbi.seeds", "generator"): "seeds.generator",
    ("swesbi.seeds", "integer_seed"): "seeds.integer_seed",
    ("swesbi.posterior.fitted", "student_law"): "stats.student_law",
    ("swesbi.posterior.marginal", "row_numbers"): "seeds.row_numbers",
    ("swesbi.posterior.marginal", "uniform"): "seeds.uniform",
    ("swesbi.recording.tables.csv_text", "read_bytes"): "files.read_bytes",
    ("swesbi.recording.tables.csv_text", "delimiter_of"): "delimiterOf",
    ("swesbi.recording.tables.csv_text", "records"): "csvRecords",
    ("swesbi.recording.tables.csv_text", "_with_plain_names"): "asWritten",
    ("swesbi.recording.tables.table", "spelling"): "spelling",
    ("swesbi.base.terminal", "visible"): "visible",
    ("swesbi.base.terminal", "hidden_signs"): "hiddenSigns",
    ("swesbi.base.terminal", "printable"): "printable",
    ("swesbi.base.workers", "in_threads"): "oneByOne",
    **{("swesbi.measurement.shared_error", name): "gatedAlone" for name in OF_PUSHES},
}
"""What JavaScript has of its own: random numbers, handed-over files, rows of CSV, signs, its one thread."""
LANES: Final = 1
"""A browser runs one simulation after another; results do not depend on how many run side by side."""
ROOTS: Final = (
    ("swesbi.heart.simulate", "simulate"),
    ("swesbi.heart.simulate", "simulate_active"),
    ("swesbi.measurement.likelihood", "SpeedModel"),
    ("swesbi.measurement.likelihood", "log_likelihood"),
    ("swesbi.measurement.speeds", "SpeedRecording"),
    ("swesbi.context", "Context"),
    ("swesbi.measurement.likelihood", "draw_speeds"),
    ("swesbi.recording.speed", "youngs_modulus_kpa"),
    ("explorer.dropped", "dropped_recording"),
    ("explorer.dropped", "dropped_hearts"),
    ("explorer.judged", "judged_without_nulls"),
    ("swesbi.measurement.speeds", "measured_speeds"),
    ("swesbi.recording.speed", "NoiseComponents"),
    ("swesbi.posterior.hearts", "HeartModel"),
    ("swesbi.posterior.adaptive", "adaptive_rounds"),
    ("swesbi.posterior.importance", "resample"),
    ("swesbi.posterior.importance", "k_hat_limit"),
    ("swesbi.draws", "interval_levels"),
)
"""What the page calls by name."""
KNOWN_CLASSES: Final = (
    "swesbi.heart.periodic.Extrapolation",
    "swesbi.heart.periodic.Lanes",
    "swesbi.heart.physiology.Physiology",
    "swesbi.measurement.clinical.ClinicalModel",
    "swesbi.measurement.speeds.WallPhases",
    "swesbi.recording.samples.Groups",
    "swesbi.recording.tables.table.Table",
    "swesbi.measurement.speeds.MeasuredBy",
    "swesbi.measurement.likelihood.SpeedModelSettings",
    "swesbi.measurement.likelihood.SpeedModel",
    "swesbi.prior.JointPriorSettings",
    "swesbi.parameters.NuisanceSettings",
    "swesbi.posterior.adaptive.AdaptedDraws",
    "swesbi.posterior.adaptive.HalvedProposals",
    "swesbi.posterior.adaptive.PriorProposal",
    "swesbi.posterior.fitted.FittedProposal",
    "swesbi.posterior.fitted.PlacedDraws",
    "swesbi.posterior.space.LogitSpace",
    "swesbi.posterior.fitted.StudentMixture",
    "swesbi.posterior.fitted.StudentProposal",
)


def physics(settings: SpeedModelSettings, exact: ExactSettings, rule: RuleSettings) -> str:
    """Return the physics of a study as JavaScript: ``physics``, with its functions and what they are given.

    Of exact posteriors the page asks for the least effective draws only.
    """
    options, own = (options_of(settings.forward_model, by_simulation) for by_simulation in (False, True))
    program = Program(
        loops={
            EQUATIONS: Loop(EQUATIONS, ((options, False), (own, True)), KERNEL_RANKS),
            ACTIVATIONS: Loop(ACTIVATIONS, ((),), ACTIVATION_RANKS),
        },
        given={("swesbi.heart.kernel", "LANES"): LANES, ("swesbi.heart.compiled", "source_key"): 0},
        own=OWN,
    )
    program.know(*KNOWN_CLASSES)
    names = [program.reference(root) for root in ROOTS]
    given = [
        f"const {name} = {literal(value, program.of_value)};"
        for name, value in (
            ("settings", settings),
            ("exact", asking(exact, exact.min_effective_draws)),
            ("rule", rule),
        )
    ]
    held = f"const physics = {{ settings, exact, rule, {', '.join(names)} }};"
    return "\n".join([program.text(), *given, held, ""])
