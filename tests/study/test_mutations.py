"""The stored tables notice a wrong sign or a lost term, and nothing that changes no result.

Each case edits a copy of the finished small study and makes some of its results again with the edited code;
the rest is as before, so what differs from the stored tables is the edit's doing. ``make test-exhaustive``
runs them, a minute or two each.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pandas as pd
import pytest
from reference_tables import SMALL_STUDY, differences, small_study
from study_copy import ROOT, StudyCopy, duplicate

EXACT_OF_A = "calibrated/subjects/A/posterior.h5"
WEIGHTED_OF_A = "amortised/subjects/A/posterior.h5"
PAPER_OF_A = "paper/subjects/A/verdict.json"


class Mutation(NamedTuple):
    """What is wrong: an edit, wherever its text occurs in ``where``, and the results that are made again.

    ``broken`` is what a quantity that no longer agrees begins with; empty where all must agree.
    """

    name: str
    old: str
    new: str
    targets: tuple[str, ...]
    broken: str = ""
    where: str = "src"

    def apply(self, folder: Path) -> None:
        """Edit every file below ``folder`` that holds the text."""
        files = self.places(folder)
        assert files, f"{self.where} does not hold {self.old!r}; write the mutation for the code as it is now"
        for file in files:
            file.write_text(file.read_text(encoding="utf-8").replace(self.old, self.new), encoding="utf-8")

    def places(self, folder: Path) -> list[Path]:
        """Return the files that hold the text."""
        files = [folder / self.where, *(folder / self.where).rglob("*.py")]
        return [file for file in files if file.is_file() and self.old in file.read_text(encoding="utf-8")]


MUTATIONS = (
    Mutation(
        "sign of the squared residual in the likelihood",
        "-0.5 * z**2 - log_sd", "0.5 * z**2 - log_sd", (EXACT_OF_A,), "posterior/median",
    ),
    Mutation(
        "log of the standard deviation lost in the likelihood",
        "-0.5 * z**2 - log_sd", "-0.5 * z**2", (EXACT_OF_A,), "posterior/log_evidence",
    ),
    Mutation(
        "what the model misses of a speed lost in the discrepancy",
        "relative_se**2 + discrepancy.speed_fraction**2 + timing**2", "relative_se**2 + timing**2",
        (EXACT_OF_A,), "posterior/log_evidence",
    ),
    Mutation(
        "prior lost in the importance weights",
        "log_parts[0] + drawn.log_likelihood - logsumexp", "drawn.log_likelihood - logsumexp",
        (EXACT_OF_A,), "posterior/log_evidence",
    ),
    Mutation(
        "Jacobian 1/theta lost in the prior's density",
        "** 2 - log_theta - of.log_norm", "** 2 - of.log_norm", (EXACT_OF_A,), "posterior/log_evidence",
    ),
    Mutation(
        "factor 3 lost in E = 3 rho c^2 of the predicted speeds",
        "np.log(squared_speed_m2_s2(stiffness, density_kg_m3))",
        "np.log(3.0 * squared_speed_m2_s2(stiffness, density_kg_m3))", (EXACT_OF_A,), "posterior/median",
    ),
    Mutation(
        "factor 3 lost in E = 3 rho c^2 of the recordings",
        "3.0 * density_kg_m3 * speed_m_s**2", "density_kg_m3 * speed_m_s**2",
        ("cohort/A/observation.h5",), "observation/stiffness_kpa",
    ),
    Mutation(
        "relaxation by k_SR lost in the kernel",
        "theta.k_atp * activation - theta.k_sr * (1.0 - activation)",
        "theta.k_atp * (2.0 * activation - 1.0)",
        ("simulations/paper/A/shard-0.h5",), "simulations/peak_kpa",
    ),
    Mutation(
        "destruction of bonds by stretching lost in the kernel",
        "abs(u) + p.alpha * abs(strain_rate)", "abs(u)",
        ("simulations/paper/A/shard-0.h5",), "simulations/peak_kpa",
    ),
    Mutation(
        "active part of late diastole lost in the passive scale",
        ".mean(axis=-1) - active_kpa[window].mean()", ".mean(axis=-1)",
        ("cohort/A/passive.h5",), "passive/scale_kpa",
    ),
    Mutation(
        "noise lost in the augmentation (Eq. 5)",
        "sd[noisy] * rng.standard_normal(", "0.0 * rng.standard_normal(", (PAPER_OF_A,), "pool/scale",
    ),
    Mutation(
        "scale lost in the standardisation",
        "(values - self.mean) / self.scale", "values - self.mean", (PAPER_OF_A,), "verdict/max_abs_z",
    ),
    Mutation(
        "criterion of prior support turned round",
        "if not abs(z_obs[j]) <= limit", "if abs(z_obs[j]) <= limit", (PAPER_OF_A,), "verdict/status",
    ),
    Mutation(
        "sign of the bias in the recovery",
        '(part["mean"] - part["truth"])', '(part["truth"] - part["mean"])',
        ("paper/recovery.csv",), "recovery/bias",
    ),
)  # fmt: skip
CONTROLS = (
    Mutation(
        "another name for a local of the passive scale",
        "excess = observed_kpa[..., window].mean(axis=-1) - active_kpa[window].mean()\n"
        "    return np.asarray(excess / shape[window].mean())",
        "remainder = observed_kpa[..., window].mean(axis=-1) - active_kpa[window].mean()\n"
        "    return np.asarray(remainder / shape[window].mean())",
        ("cohort/A/passive.h5",),
    ),
    Mutation(
        "another local in the likelihood",
        "total = logsumexp(log_joint(predicted, recording, discrepancy), axis=0)",
        "found = log_joint(predicted, recording, discrepancy)\n    total = logsumexp(found, axis=0)",
        (EXACT_OF_A,),
    ),
    Mutation(
        "learning rate of features changed by a rounding error",
        "learning_rate: 0.002", "learning_rate: 0.002000001",
        (PAPER_OF_A, "paper/recovery.csv", "paper/subjects/A/predictive.h5"), where="smoke.yaml",
    ),
    Mutation(
        "learning rate of speeds changed by a rounding error",
        "learning_rate: 6.0e-3", "learning_rate: 6.000001e-3",
        (EXACT_OF_A, "calibrated/subjects/A/calibration_recordings.h5"), where="config/experiments.yaml",
    ),
    Mutation(
        "learning rate of the population changed by a rounding error",
        "learning_rate: 4.0e-3", "learning_rate: 4.000001e-3",
        (WEIGHTED_OF_A,), where="config/population.yaml",
    ),
)  # fmt: skip


@pytest.mark.parametrize("mutation", [*MUTATIONS, *CONTROLS], ids=lambda mutation: mutation.name)
def test_the_text_of_every_mutation_is_there(mutation: Mutation) -> None:
    folder = ROOT / "tests" if mutation.where == "smoke.yaml" else ROOT
    assert mutation.places(folder), "write the mutation for the code as it is now"


def apart_after(mutation: Mutation, finished: StudyCopy, folder: Path) -> pd.DataFrame:
    """Edit a finished study, make the mutation's targets again, and return what differs from the tables."""
    study = duplicate(finished, folder)
    mutation.apply(study.folder)
    study.run(*(f"{study.results.name}/{target}" for target in mutation.targets))
    return differences(small_study(study.results), SMALL_STUDY)


@pytest.mark.exhaustive
@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.name)
def test_the_tables_notice(finished: StudyCopy, tmp_path: Path, mutation: Mutation) -> None:
    apart = apart_after(mutation, finished, tmp_path / "study")
    assert apart["quantity"].str.startswith(mutation.broken).any(), apart.to_string()


@pytest.mark.exhaustive
@pytest.mark.parametrize("control", CONTROLS, ids=lambda mutation: mutation.name)
def test_what_changes_no_result_goes_unnoticed(
    finished: StudyCopy, tmp_path: Path, control: Mutation
) -> None:
    apart = apart_after(control, finished, tmp_path / "study")
    assert apart.empty, apart.to_string()
