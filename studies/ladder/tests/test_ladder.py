"""The ladder: probabilities and averages in closed form, moved proposals, evidence, what moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest
from exact_study import EXACT, write_inputs
from ladder_case import EFFORT, LADDER, LADDER_CONFIG, PAIRS, QUICK, SEED, result, rung, wide_proposal
from speed_case import PHI, ROOT, model, settings

from studies.ladder import stages as stage
from studies.ladder.infer import best_pair, infer_structure, second_recording
from studies.ladder.posteriors import CHANGED, CHOSEN, KIND, SHIPPED, read_structure, to_groups
from studies.ladder.proposal import MovedProposal, first_proposal
from studies.ladder.quantities import changed_recording, quantities_of
from studies.ladder.settings import LadderEffort, LadderSettings, run_settings
from studies.ladder.summary import moves_table, pairs_table, total_evidence
from studies.ladder.table import AVERAGE, averaged, ladder_table, model_probabilities
from swesbi.artefacts import Origin, Provenance, save
from swesbi.config.read import ConfigError, parse_section, read_merged
from swesbi.config.study import load_study
from swesbi.measurement.operator import SERIES_MODULUS_KPA
from swesbi.networks.flow.flow import FlowProposal
from swesbi.posterior.space import Space
from swesbi.prior import ParameterPrior, SimulatedPrior, in_bounds, log_centre

STUDY = load_study(read_merged(ROOT / "config.yaml") | {"cohort": str(ROOT / "data" / "virtual_volunteers")})
LABELS = {"base": "as configured", "other": "another"}
FILES = {
    "table": ".csv",
    "pairs": "_pairs.csv",
    "moves": "_moves.csv",
    "figure_pdf": ".pdf",
    "figure_png": ".png",
}


def table(factor: float = 1.5, log_evidence: float = float(np.log(3.0)), se: float = 0.0) -> pd.DataFrame:
    results = {"base": result(), "other": result(factor=factor, log_evidence=log_evidence, se=se)}
    return ladder_table(results, LABELS, 0.9, SEED)


def rows(frame: pd.DataFrame, structure: str, quantity: str, answer: str = SHIPPED) -> pd.DataFrame:
    chosen = (frame["structure"] == structure) & (frame["quantity"] == quantity) & (frame["answer"] == answer)
    return frame[chosen]


def test_probabilities_follow_from_evidence() -> None:
    found = model_probabilities(np.log([1.0, 3.0]) - 400.0, np.array([0.1, 0.2]))
    np.testing.assert_allclose(found.probability, [0.25, 0.75])
    # of two structures, the log odds have the variance of the difference
    np.testing.assert_allclose(found.se, 0.25 * 0.75 * np.hypot(0.1, 0.2))


def test_the_error_of_probabilities_is_that_of_repeated_evidence() -> None:
    log_evidence, se = np.array([0.0, 0.7, -1.2]), np.array([0.05, 0.02, 0.1])
    repeats = log_evidence + se * np.random.default_rng(1).standard_normal((20_000, 3))
    drawn = np.array([model_probabilities(row, se).probability for row in repeats])
    np.testing.assert_allclose(model_probabilities(log_evidence, se).se, drawn.std(axis=0), rtol=0.03)


def test_an_average_is_the_mixture() -> None:
    rng = np.random.default_rng(2)
    parts = [rng.normal(0.0, 1.0, (4000, 1)), rng.normal(3.0, 2.0, (1000, 1))]
    mixture = averaged(parts, np.array([0.3, 0.7]), rng)
    assert mixture.shape == (4000, 1)
    assert mixture.mean() == pytest.approx(0.7 * 3.0, abs=0.15)
    assert mixture.var() == pytest.approx(0.3 + 0.7 * 4.0 + 0.3 * 0.7 * 9.0, rel=0.1)


def moved_prior(name: str, factor: float) -> SimulatedPrior:
    prior = settings("calibrated").prior.simulated
    own = getattr(prior.theta.nuisances, name)
    values = {key: factor * getattr(own, key) for key in ("centre", "low", "high")}
    nuisances = prior.theta.nuisances.model_copy(update={name: ParameterPrior(log_sd=own.log_sd, **values)})
    return prior.model_copy(update={"theta": prior.theta.model_copy(update={"nuisances": nuisances})})


class FakeFlow:
    """A wide proposal with the base space of a flow."""

    def __init__(self, prior: SimulatedPrior) -> None:
        self.flow, self._wide = SimpleNamespace(prior=prior), wide_proposal(prior)
        self.draw, self.place, self.at = self._wide.draw, self._wide.place, self._wide.at
        self.log_density, self.log_density_at = self._wide.log_density, self._wide.log_density_at


def fake_flow(prior: SimulatedPrior) -> FlowProposal:
    return cast("FlowProposal", FakeFlow(prior))


def test_a_proposal_moves_with_its_prior() -> None:
    home, prior = settings("calibrated").prior.simulated, moved_prior("destruction_alpha", 2.5)
    flow = fake_flow(home)
    moved = first_proposal(flow, prior)
    assert isinstance(moved, MovedProposal)
    factors = log_centre(prior) / log_centre(home)
    assert sorted(set(np.round(factors, 6))) == [1.0, 2.5]
    phi = moved.draw(500, 3)
    np.testing.assert_allclose(phi, factors * flow.draw(500, 3), rtol=1e-9)
    assert in_bounds(phi, prior).all()
    np.testing.assert_allclose(
        moved.log_density(phi), flow.log_density(phi / factors) - np.log(2.5), rtol=1e-6
    )
    u, log_slope = moved.place(phi)
    np.testing.assert_allclose(moved.at(u), phi, rtol=1e-9)
    np.testing.assert_allclose(log_slope, flow.place(phi / factors)[1] - np.log(2.5), rtol=1e-6)


def test_a_moved_proposal_is_refined_in_the_base_space_of_its_flow() -> None:
    prior = settings("calibrated").prior.simulated
    assert isinstance(MovedProposal(fake_flow(prior), prior, moved_prior("sigma_0_pa", 1.1)), Space)


def test_a_network_of_the_same_prior_is_taken_as_it_is_and_one_of_other_parameters_refused() -> None:
    flow = fake_flow(settings("calibrated").prior.simulated)
    assert first_proposal(flow, settings("calibrated").prior.simulated) is flow
    with pytest.raises(ValueError, match=r"the network infers .*alpha.*, the structure k0_kpa.*train anew"):
        first_proposal(flow, settings("paper").prior.simulated)


def test_what_elastography_shows_is_less_than_what_bonds_attain_behind_a_spring() -> None:
    plain, phi = model(), np.stack([PHI, 1.1 * PHI])
    found = quantities_of(plain, phi)
    active = plain.simulate(phi).active_stiffness_kpa.max(axis=1)
    np.testing.assert_array_equal(found, np.column_stack([phi, active, active]))
    measurement = plain.settings.measurement.model_copy(update={"active_stiffness_map": "series_spring"})
    behind = replace(plain, settings=plain.settings.model_copy(update={"measurement": measurement}))
    seen = active * SERIES_MODULUS_KPA / (active + SERIES_MODULUS_KPA)
    np.testing.assert_allclose(quantities_of(behind, phi), np.column_stack([phi, active, seen]))


def test_a_changed_person_keeps_the_errors_of_the_first_recording() -> None:
    made = model()  # noiseless, at PHI
    errors = np.exp(0.05 * np.random.default_rng(3).standard_normal(made.recording.phase.size))
    noisy = replace(made, recording=replace(made.recording, speed_m_s=errors * made.recording.speed_m_s))
    changed = PHI * np.array([1.25, 1.0, 0.8, 1.0])
    second = changed_recording(noisy, PHI, EFFORT.change)
    np.testing.assert_allclose(second.speed_m_s, errors * made.predict(changed[None]).speed_m_s[0])
    with pytest.raises(ValueError, match="subject T: changed by .*k0_kpa.* leaves the prior"):
        changed_recording(noisy, PHI, {"k0_kpa": 40.0})


def test_a_person_is_the_median_of_what_the_network_knows() -> None:
    network = wide_proposal(settings().prior.simulated)
    second = second_recording(model(), network, SEED, EFFORT, 500)
    again = second_recording(model(), network, SEED, EFFORT, 500)
    np.testing.assert_array_equal(second.speed_m_s, again.speed_m_s)
    assert not np.allclose(second.speed_m_s, model().recording.speed_m_s)


def test_a_structure_is_inferred_at_both_discrepancies_and_for_the_changed_person() -> None:
    plain = model()
    changed = replace(plain, recording=changed_recording(plain, PHI, EFFORT.change))
    found = infer_structure([plain], [changed], rung(plain.settings.prior.simulated), "test")
    shipped, chosen, second = (found.answers(name)["T"] for name in (SHIPPED, CHOSEN, CHANGED))
    assert shipped.converged and second.converged and chosen.converged
    # the bank and the weights of the posterior are two estimates of one evidence
    (scores,) = found.evidence
    assert found.pairs[0] == plain.settings.discrepancy
    assert len(found.pairs) == 3
    error = np.hypot(shipped.log_evidence_se, scores.log_evidence_se[0])
    assert error < 0.2
    assert shipped.log_evidence == pytest.approx(scores.log_evidence[0], abs=4.0 * error)
    # the recording is the model's own, without noise: the smallest discrepancy explains it best
    assert found.pairs[best_pair(found.evidence)].speed_fraction == 0.01
    assert (chosen.speed_fraction, shipped.speed_fraction, second.speed_fraction) == (0.01, 0.02, 0.02)
    assert chosen.log_evidence > shipped.log_evidence
    ratio = np.median(second.values, axis=0) / np.median(shipped.values, axis=0)
    np.testing.assert_allclose(ratio[[0, 2]], [1.25, 0.8], rtol=0.1)


def test_where_the_evidence_chooses_the_shipped_pair_its_posterior_is_that_one() -> None:
    plain = model()
    alone = rung(plain.settings.prior.simulated, EXACT)
    effort = QUICK.model_copy(update={"speed_fractions": (0.02,)})
    found = infer_structure([plain], [plain], replace(alone, effort=effort), "test")
    assert found.answers(CHOSEN)["T"].values is found.answers(SHIPPED)["T"].values


def test_the_table_measures_moves_in_widths_and_weighs_structures() -> None:
    frame = table()
    other = rows(frame, "other", "k0_kpa")
    np.testing.assert_allclose(other["shift_in_widths"], 5.0 / 1.8)  # from 10 to 15; 90 % of a width of 2
    np.testing.assert_allclose(other["width_ratio"], 1.5)
    np.testing.assert_allclose(other["probability"], 0.75)
    np.testing.assert_allclose(rows(frame, "base", "k0_kpa")["shift_in_widths"], 0.0)
    np.testing.assert_allclose(rows(frame, "other", "k_sr_per_s")["shift_in_widths"], 0.0)
    average = rows(frame, AVERAGE, "k0_kpa")
    np.testing.assert_allclose(average["log_evidence"], np.log((1.0 + 3.0) / 2.0))
    draws = np.concatenate([np.linspace(9.0, 11.0, 1001), np.linspace(13.5, 16.5, 3001)])
    np.testing.assert_allclose(average["median"], np.median(draws), rtol=0.01)
    assert list(dict.fromkeys(frame["structure"])) == ["base", "other", AVERAGE]
    assert list(dict.fromkeys(frame["answer"])) == [SHIPPED, CHOSEN]


def test_a_change_within_a_person_is_a_ratio_and_stays_where_k0_moves() -> None:
    frame = table()
    for name in ("base", "other"):
        np.testing.assert_allclose(rows(frame, name, "change_of_k0_kpa")["median"], 1.25, rtol=1e-3)
    np.testing.assert_allclose(rows(frame, "other", "change_of_k0_kpa")["shift_in_widths"], 0.0, atol=1e-12)
    assert rows(frame, "base", "change_of_k0_kpa", CHOSEN).empty


def test_what_survives_is_what_no_structure_moves() -> None:
    moves = moves_table(table(), 0.5).set_index("quantity")
    assert moves.loc["k0_kpa", "survives"] == 0
    assert moves.loc["k0_kpa", "structure"] == "other"
    assert moves.loc["k0_kpa", "within"] == 0.0
    others = moves.drop("k0_kpa")
    assert (others["survives"] == 1).all()
    assert others["largest_shift"].max() < 1e-9


def test_total_evidence_is_that_of_one_structure_for_all_subjects() -> None:
    total = total_evidence(table(se=0.3)).set_index(["answer", "structure"])
    np.testing.assert_allclose(total.loc[(SHIPPED, "other"), "against_base"], 2.0 * np.log(3.0))
    np.testing.assert_allclose(total.loc[(SHIPPED, "other"), "probability"], 0.9)
    np.testing.assert_allclose(total.loc[(CHOSEN, "other"), "log_evidence_se"], 0.3 * np.sqrt(2.0))


def test_the_evidence_of_pairs_marks_its_choice_and_that_among_those_which_cover() -> None:
    frame = pairs_table({"base": result()}, {"base": "as configured"})
    np.testing.assert_allclose(frame["log_evidence"], [0.0, 4.0, -2.0])
    np.testing.assert_allclose(frame["below_best"], [4.0, 0.0, 6.0])
    assert frame["best"].tolist() == [0, 1, 0]  # a delta of 0.01, below the shipped 0.02
    assert frame["covering"].tolist() == [1, 0, 1]
    assert frame["best_covering"].tolist() == [1, 0, 0]


def test_structures_with_other_subjects_are_refused() -> None:
    with pytest.raises(ValueError, match="structures with other subjects"):
        ladder_table({"base": result(), "other": result(("A", "C"))}, LABELS, 0.9, SEED)


def written(path: Path, factor: float = 1.0, log_evidence: float = 0.0) -> Path:
    made = result(factor=factor, log_evidence=log_evidence)
    save(path, to_groups(made), Provenance(KIND, "", 1, {}, "0" * 16))
    return path


def test_what_a_structure_gave_is_read_back(tmp_path: Path) -> None:
    made, found = result(), read_structure(written(tmp_path / "base.h5"))
    assert [(one.subject, one.answer) for one in found.posteriors] == [
        (one.subject, one.answer) for one in made.posteriors
    ]
    np.testing.assert_array_equal(found.posteriors[1].values, made.posteriors[1].values)
    assert found.pairs == PAIRS
    np.testing.assert_array_equal(found.evidence[1].log_evidence, made.evidence[1].log_evidence)
    assert not found.posteriors[0].by_mcmc
    assert found.posteriors[0].converged


@pytest.fixture(scope="module")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("outputs")
    paths = {name: folder / f"ladder{ending}" for name, ending in FILES.items()}
    structures = [written(folder / "other.h5", factor=1.5, log_evidence=1.0), written(folder / "base.h5")]
    plain = {"cohort_title": "volunteers", "interval": 0.9, "survives_widths": 0.5, "labels": LABELS}
    stage.ladder(
        structures=structures,
        **paths,
        settings=stage.LadderStageSettings.from_plain(plain),
        origin=Origin(SEED),
    )
    return paths


def test_the_stage_writes_tables_and_a_figure(outputs: dict[str, Path]) -> None:
    assert all(path.stat().st_size > 100 for path in outputs.values())
    frame = pd.read_csv(outputs["table"])
    assert len(frame) == 3 * 2 * (10 + 6)
    assert set(pd.read_csv(outputs["pairs"])["structure"]) == set(LABELS)


@pytest.mark.parametrize("structure", sorted(LADDER.structures))
def test_every_structure_is_a_valid_configuration(structure: str) -> None:
    found = run_settings(STUDY, LADDER, structure)
    assert (found["model"] == found["base"]) == (structure == "base")
    assert found["model"]["discrepancy"] == found["base"]["discrepancy"]
    typed = stage.LadderRunStageSettings.from_plain(found)
    assert typed.model.prior.names == typed.base.prior.names  # the network's own parameters


def test_a_centre_that_moves_is_that_of_the_forward_model_too() -> None:
    for structure in ("alpha_4", "physiological_timing"):
        found = run_settings(STUDY, LADDER, structure)["model"]
        nuisances, heart = found["prior"]["theta"]["nuisances"], found["forward_model"]
        moved = LADDER.structures[structure].changes["priors"]["calibrated"]["nuisances"]
        names = moved.keys() & heart.keys()
        assert "destruction_alpha" in names
        for name in names:
            assert nuisances[name]["centre"] == heart[name], (structure, name)


def test_a_wrong_ladder_is_refused_by_its_key() -> None:
    def changed(**values: object) -> LadderSettings:
        return parse_section(LADDER_CONFIG | values, "ladder", LadderSettings)

    with pytest.raises(ConfigError, match="ladder.experiment = 'paper' is neither"):
        run_settings(STUDY, changed(experiment="paper"), "base")
    with pytest.raises(ConfigError, match="needs the structure 'base'"):
        changed(structures={"a": {"label": "a", "changes": {}}, "b": {"label": "b", "changes": {}}})
    with pytest.raises(ConfigError, match="change.k_x = 2"):
        changed(change={"k_x": 2.0})
    with pytest.raises(ConfigError, match="max_round = 3.*did you mean 'max_rounds'"):
        changed(max_round=3)
    wrong = {"label": "x", "changes": {"passive": {"exponent_b": -1.0}}}
    with pytest.raises(ConfigError, match=r"ladder\.structures\.x\.changes: 1 problem"):
        run_settings(STUDY, changed(structures=LADDER_CONFIG["structures"] | {"x": wrong}), "x")


def test_the_shipped_pair_leads_the_grid_and_stands_in_it_once() -> None:
    effort = LadderEffort.model_validate(EFFORT.model_dump() | {"speed_fractions": (0.01, 0.02)})
    pairs = effort.pairs(PAIRS[0])
    assert pairs[0] == PAIRS[0]
    assert len(pairs) == len(set(pairs)) == 2


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    paths = write_inputs(tmp_path_factory.mktemp("ladder"))
    return {"observations": [paths["observation"]], "noise": paths["noise"], "estimator": paths["estimator"]}


def test_the_stage_infers_a_structure_from_the_network_of_the_study(
    inputs: dict[str, Any], tmp_path: Path
) -> None:
    base = settings()
    heart = base.forward_model.model_copy(update={"stress_measure": "second_piola"})
    plain = {
        "base": base.to_plain(),
        "model": base.model_copy(update={"forward_model": heart}).to_plain(),
        "exact": EXACT.to_plain(),
        "effort": QUICK.to_plain(),
    }
    paths = [tmp_path / name / "second_piola.h5" for name in ("one", "two")]
    for path in paths:
        stage.ladder_run(
            **inputs,
            posteriors=path,
            settings=stage.LadderRunStageSettings.from_plain(plain),
            origin=Origin(SEED, "", "c"),
        )
    assert paths[0].read_bytes() == paths[1].read_bytes()
    found = read_structure(paths[0])
    assert {one.answer for one in found.posteriors} == {SHIPPED, CHOSEN, CHANGED}
    assert found.pairs[0] == base.discrepancy
    best = found.pairs[best_pair(found.evidence)]
    assert found.answers(CHOSEN)["T"].speed_fraction == best.speed_fraction
