"""Training one flow for every context of a population."""

from __future__ import annotations

from swesbi.flow.epochs import Rows
from swesbi.flow.phases import fit_phase_conditioner
from swesbi.flow.settings import FlowSettings
from swesbi.flow.training import FlowParts, FlowTraining, fit_flow
from swesbi.inference.standardisation import fit_standardisation
from swesbi.population.rows import RowMaker, split_by_context
from swesbi.population.simulations import PopulationSimulations


def train_population(
    made: PopulationSimulations, maker: RowMaker, settings: FlowSettings, label: str = "training"
) -> FlowTraining:
    """Fit q(phi | z) on simulations over a population, recordings drawn anew every epoch.

    Contexts are split into training and held-out ones; standardisation comes from the training ones; the
    weights of the best epoch on the held-out ones are kept. Runs on one thread and repeats to the bit.

    Raises:
        ValueError: Too few contexts for a split.
        TrainingDivergedError: The loss was not finite too often.
    """
    training, held_out = split_by_context(made, settings.validation_fraction)
    raw_eta, inputs = maker.raw(training, "statistics")
    eta, conditioner = fit_standardisation(raw_eta), fit_phase_conditioner(inputs, maker.phases)
    del raw_eta, inputs

    def rows_of(part: PopulationSimulations, name: str, number: int) -> Rows:
        return maker.rows(part, conditioner, eta, name, number)

    parts = FlowParts(conditioner, eta, maker.model.prior)
    return fit_flow(training, held_out, rows_of, parts, settings, maker.seed, label)
