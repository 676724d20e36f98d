"""Statements scored again: what other trainings, recordings and readings change, and what they do not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from study_copy import ROOT, StudyCopy, run_side_study

from studies.statements.judge import chosen
from studies.statements.recorded import RecordedSettings, rerecorded, volunteer_of
from studies.statements.recovery import ExperimentSettings, known_recordings
from studies.statements.settings import Reading, StatementsSettings, judged_settings, own_network, own_pool
from studies.statements.stages import judged
from studies.statements.table import readings_table, scores_table, stability_table
from swesbi.artefacts import ArtefactError
from swesbi.config.read import ConfigError, overlay, parse_section, read_merged, read_yaml
from swesbi.config.study import Study, load_study
from swesbi.measurement.likelihood import MeasuredSubject, reference_beat
from swesbi.measurement.operator import calibrate_passive
from swesbi.measurement.settings import summary_names
from swesbi.networks.files import Standardisation
from swesbi.recording.ingest import ingest
from swesbi.study.job import typed_settings
from swesbi.virtual.volunteers import VOLUNTEERS, record, simulate_truth

SECTION = read_yaml(ROOT / "studies" / "statements" / "config.yaml")["statements"]
STATEMENTS = parse_section(SECTION, "statements", StatementsSettings)
AS_SET = Reading(label="as configured")


@cache
def study() -> Study:
    plain = overlay(read_merged(ROOT / "config.yaml"), read_yaml(ROOT / "tests" / "smoke.yaml"))
    return load_study(plain | {"cohort": str(ROOT / "data" / "virtual_volunteers")})


@cache
def settings() -> dict[str, Any]:
    """What the judgement of the study's own training depends on."""
    return typed_settings(judged, judged_settings(study(), STATEMENTS, "training-1") | {"seed": 1})


def recorded() -> RecordedSettings:
    own: RecordedSettings = settings()["recorded"]
    return own


def paper() -> ExperimentSettings:
    own: ExperimentSettings = settings()["experiments"]["paper"]
    return own


@cache
def shipped() -> MeasuredSubject:
    own = recorded()
    context = VOLUNTEERS[0].context
    samples = record(simulate_truth(VOLUNTEERS[0]), 1)
    observed = ingest(samples, context, own.recording, own.measurement.grid_points)
    reference = reference_beat(context, own.reference_prior, own.forward_model)
    passive = calibrate_passive(observed, reference, own.passive, own.measurement)
    return MeasuredSubject(observed, passive, own.measurement)


def test_only_what_a_variant_changes_is_made_anew() -> None:
    made = {
        variant: (
            own_pool(study(), STATEMENTS, variant, name),
            own_network(study(), STATEMENTS, variant, name),
        )
        for name in ("paper",)
        for variant in STATEMENTS.variants
    }
    assert made["training-1"] == (False, False) and made["training-2"] == (False, True)
    assert made["reading-former_landmarks"] == own_pool_of("landmarks")
    assert made["reading-own_beat"] == made["reading-laboratory"] == (False, False)
    assert not own_network(study(), STATEMENTS, "reading-former_landmarks", "scalar_only")
    seeds = {STATEMENTS.seed(variant, 7) for variant in STATEMENTS.variants}
    assert len(seeds) == len(STATEMENTS.trainings) and STATEMENTS.seed("training-1", 7) == 7


def own_pool_of(key: str) -> tuple[bool, bool]:
    """Whether the former reading differs from what is configured."""
    differs = study().config.feature_experiments["paper"].to_plain()["summary"][key] != "paper"
    return differs, differs


def test_a_reading_that_needs_other_simulations_is_refused() -> None:
    wide = {"other": {"label": "x", "changes": {"forward_model": {"length_dependence": 0.5}}}}
    other = parse_section(SECTION | {"readings": wide}, "statements", StatementsSettings)
    with pytest.raises(ConfigError, match="judged on the study's simulations"):
        judged_settings(study(), other, "reading-other")


def test_the_shipped_recording_is_taken_as_it_is_and_others_are_recorded_again() -> None:
    own = recorded()
    assert rerecorded(shipped(), 1, AS_SET, own).subject is shipped()
    again = rerecorded(shipped(), 2, AS_SET, own)
    assert again.trained is shipped() and again.name == "A"
    assert not np.allclose(again.subject.observation.curve_kpa, shipped().observation.curve_kpa)
    loud = own.model_copy(
        update={"acquisition": own.acquisition.model_copy(update={"sample_sd_fraction": 0.3})}
    )
    noise = [
        rerecorded(shipped(), 2, reading, loud).subject.observation.noise.sample_fraction
        for reading in (AS_SET, AS_SET.model_copy(update={"noise": "laboratory"}))
    ]
    assert noise[1] > 2.0 * noise[0]
    with pytest.raises(ArtefactError, match="Z: its context is that of no virtual volunteer"):
        volunteer_of(replace(VOLUNTEERS[0].context, subject="Z"))


def test_features_are_standardised_by_their_own_statistics_and_contexts_are_not() -> None:
    own = paper()
    width = len(summary_names(own.summary)) + 7
    known = Standardisation(np.full(width, 3.0), np.full(width, 2.0))
    pool = SimpleNamespace(standardisation=known)
    found = {
        how: known_recordings((shipped(),), pool, own, how, 3.0, 5)  # type: ignore[arg-type]
        for how in ("as_trained", "own_statistics", "own_beat")
    }
    for truth, z in found.values():
        np.testing.assert_array_equal(truth, found["as_trained"][0])
        np.testing.assert_array_equal(z[:, -7:], found["as_trained"][1][:, -7:])
    own_z = found["own_statistics"][1][:, :-7]
    np.testing.assert_allclose(own_z.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(own_z.std(axis=0), 1.0, atol=1e-9)
    apart = np.abs(found["own_beat"][1] - found["as_trained"][1])[:, 0]
    assert 0.0 < apart.max() < 5.0


def test_without_passive_stiffness_it_does_not_matter_along_which_beat_it_runs() -> None:
    own = paper()
    bare = shipped().passive
    bare = replace(bare, scale_kpa=0.0, stiffness_kpa=0.0 * bare.stiffness_kpa)
    subject = replace(shipped(), passive=bare)
    width = len(summary_names(own.summary)) + 7
    pool = SimpleNamespace(standardisation=Standardisation(np.zeros(width), np.ones(width)))
    one, other = (
        known_recordings((subject,), pool, own, how, 3.0, 5)[1]  # type: ignore[arg-type]
        for how in ("as_trained", "own_beat")
    )
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)


def test_the_network_is_that_of_the_epoch_asked_for() -> None:
    nets = [SimpleNamespace(epoch=epoch, best=epoch == 3) for epoch in (1, 3, 9)]

    def epoch(asked: str | int) -> int:
        return chosen(nets, asked).epoch  # type: ignore[arg-type]

    assert [epoch(asked) for asked in ("best", "last", 1)] == [3, 9, 1]
    with pytest.raises(ValueError, match="epoch 2 has no checkpoint; there are those of 1, 3, 9"):
        epoch(2)


def judgement(*rows: tuple[int, str, str, str, str]) -> pd.DataFrame:
    columns = ["acquisition", "statement", "this_study", "agrees", "origin"]
    return pd.DataFrame(rows, columns=columns).assign(paper="1.0")


def test_scores_and_what_readings_move() -> None:
    by_variant = {
        "training-1": judgement(
            (1, "a", "1.0 ± 0.1", "yes", "found"), (1, "b", "yes", "yes", "designed"),
            (2, "a", "3.0 ± 0.1", "no", "found"), (2, "b", "no", "no", "designed"),
        ),
        "training-2": judgement(
            (1, "a", "2.0 ± 0.1", "no", "found"), (1, "b", "yes", "yes", "designed"),
            (2, "a", "2.0 ± 0.1", "no", "found"), (2, "b", "yes", "yes", "designed"),
        ),
        "reading-quiet": judgement((1, "a", "9.0", "no", "found"), (1, "b", "yes", "yes", "designed")),
    }  # fmt: skip
    scores = scores_table(by_variant)
    assert scores[["training", "acquisition", "agree", "designed", "of"]].to_numpy().tolist() == [
        [1, 1, 2, 1, 2],
        [1, 2, 0, 0, 2],
        [2, 1, 1, 1, 2],
        [2, 2, 1, 1, 2],
    ]
    stability = stability_table(by_variant).set_index("statement")
    assert stability.loc["a", ["agrees", "of", "mean", "low", "high"]].tolist() == [1, 4, 2.0, 1.0, 3.0]
    assert stability.loc["b", ["agrees", "of"]].tolist() == [3, 4] and np.isnan(stability.loc["b", "mean"])
    readings = readings_table(by_variant, {"quiet": "quieter"}).set_index("reading")
    assert readings.loc["quieter", ["agree", "of", "gained", "lost", "moved"]].tolist() == [
        1,
        2,
        "",
        "a: 9.0",
        1,
    ]
    assert readings.loc["as configured", ["agree", "moved"]].tolist() == [2, 0]


@pytest.mark.slow(minutes=2)
def test_the_small_study_is_judged_as_it_judges_itself(own_study: StudyCopy) -> None:
    """Its own networks on the shipped recordings give the study's own statements; others give others."""
    found = run_side_study(own_study, "statements")
    known = pd.read_csv(own_study.results / "tables" / "statements.csv").set_index("statement")
    again = pd.read_csv(found / "judged" / "training-1.csv")
    first = again[again["acquisition"] == 1].set_index("statement")
    # draws are counted only until there are enough, and CMA-ES makes fewer runs
    counted = [name for name in known.index if "draw" in name or "CMA-ES" in name]
    compared = ["paper", "this_study", "agrees", "origin"]
    pd.testing.assert_frame_equal(first[compared].drop(counted), known[compared].drop(counted))
    other = pd.read_csv(found / "judged" / "training-2.csv")
    changed = other[other["acquisition"] == 1].set_index("statement")["this_study"] != first["this_study"]
    assert {"recovery of k_0 (%)", "RMSE of the posterior's median (kPa)"} & set(changed.index[changed])
    scores = pd.read_csv(found / "scores.csv")
    assert scores[["training", "acquisition"]].to_numpy().tolist() == [[1, 1], [1, 2], [2, 1], [2, 2]]
    assert (scores["of"] == 23).all()
    readings = pd.read_csv(found / "readings.csv")
    assert readings["reading"][0] == "as configured" and len(readings) == 6
