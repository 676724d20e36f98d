"""Free-running recordings are answered from the prior on: right posteriors, and all that an answer has."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import exact_case
import free_case
import numpy as np
import pytest
import speed_case
from study_copy import ROOT

from swesbi.answers.recording import observe
from swesbi.config.read import ConfigError, overlay, read_merged
from swesbi.config.study import Study, load_study
from swesbi.draws import median_and_interval
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import SpeedRecording
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.exact import exact_posterior
from swesbi.posterior.importance import resample
from swesbi.prior import draw_prior
from swesbi.recording.phases import cells_of
from swesbi.recording.problems import RecordingError
from swesbi.study.answerer import answer_settings
from swesbi.verdict.nulls import residuals_p_value

SETTINGS = exact_case.SETTINGS.model_copy(update={"effective_draws": 1500})


def as_pushes(gated: SpeedRecording, repeats: int, seed: int = 1) -> SpeedRecording:
    """A gated recording as single pushes about each mean, with errors as large as make those of the mean."""
    apart = 0.05 * np.random.default_rng(seed).standard_normal((len(gated.phase), repeats))
    apart -= apart.mean(axis=1, keepdims=True)
    return replace(
        gated,
        phase=np.repeat(gated.phase, repeats),
        speed_m_s=(gated.speed_m_s[:, None] * np.exp(apart)).ravel(),
        relative_se=np.repeat(gated.relative_se * np.sqrt(repeats), repeats),
        shared=np.empty((repeats * len(gated.phase), 0)),
        cell=np.repeat(np.arange(len(gated.phase)), repeats),
    )


@pytest.mark.slow(minutes=1)
def test_a_gated_recording_as_pushes_has_its_gated_posterior() -> None:
    """Quantiles agree within Monte Carlo error, from the prior on and from a fitted proposal."""
    gated = speed_case.model()
    pushes = replace(gated, recording=as_pushes(gated.recording, 3))
    free = exact_posterior(pushes, None, SETTINGS, 3)[0]
    assert free.converged
    weighted = exact_case.weigh(gated, exact_case.fitted(gated), 8000, 0.1, 5)
    known = resample(weighted, 4000, np.random.default_rng(6))
    effective = min(float(free.effective_draws.min()), weighted.efficiency * 8000)
    for level in (0.05, 0.25, 0.5, 0.75, 0.95):
        # the error of a quantile is that of the share below it
        below = np.mean(free.phi < np.quantile(known, level, axis=0), axis=0)
        error = np.sqrt(level * (1.0 - level) * 2.0 / min(effective, 4000.0))
        np.testing.assert_allclose(below, level, atol=4.5 * error)


@pytest.mark.slow(minutes=1)
def test_intervals_cover_what_made_the_recording() -> None:
    """The truth is inside where errors are declared too small or too large by a factor of its own prior.

    Without the integral over that factor they cover 73 %, with it 91 %.
    """
    rng = np.random.default_rng(8)
    blank, covered = speed_case.model(), []
    for index in range(40):
        phase = np.sort(rng.random(25))
        ones = np.ones(25)
        recording = SpeedRecording(
            blank.recording.context, phase, ones, 0.1 * ones, np.empty((25, 0)), cells_of(phase, 20), 0.8
        )
        model = replace(blank, recording=recording)
        phi = draw_prior(model.settings.prior, 1, rng)
        wider = recording.relative_se * np.exp(0.8 * rng.standard_normal())
        known = replace(model, recording=replace(recording, relative_se=wider, errors_log_sd=0.0))
        speed = known.draw_speeds(model.predict(phi), rng)[0]
        if not np.isfinite(speed).all():
            continue
        seen = replace(model, recording=replace(recording, speed_m_s=speed))
        for last in adaptive_rounds(seen, SETTINGS, index):
            weighted = last.weighted
        draws = resample(weighted, 2000, rng)
        low, _, high = median_and_interval(draws, 0.9)
        covered.extend(((phi[0] >= low) & (phi[0] <= high)).tolist())
    # four parameters of forty recordings: 0.9 +- 3.5 standard errors, were they all independent
    assert 0.80 < np.mean(covered) <= 0.985


@pytest.fixture
def asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Study:
    """The study asked of a cohort of a gated recording of 20 phases, one of 24 and a free-running one."""
    monkeypatch.chdir(ROOT)
    cohort = free_case.mixed(tmp_path / "mixed")
    return load_study(read_merged(ROOT / "config.yaml"), new_cohort=cohort)


def test_each_recording_of_a_mixed_cohort_is_asked_by_its_own_protocol(asked: Study) -> None:
    phases = {name: answer_settings(asked, "calibrated", name).recording.phases for name in ("S-1", "s_2x")}
    assert list(phases.values()) == [20, 24]
    observed = [observe(asked, name).observation for name in ("S-1", "s_2x", "S-3")]
    assert [one.is_gated for one in observed] == [True, True, False]
    assert (observed[2].errors_from, observed[2].errors_log_sd) == ("declared", 0.3)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        (free_case.MITRAL_WAVES, "natural waves are not interpreted"),
        (
            free_case.train(2).assign(event="AVC").to_csv(index=False),
            "column 'event': says what set off each wave",
        ),
        (free_case.train(2, lost=1.0).to_csv(index=False), "0 pushes are acceptable"),
    ],
)
def test_natural_waves_and_pushes_that_cannot_be_used_are_refused(
    asked: Study, table: str, message: str
) -> None:
    (asked.outside.folder / "swe" / "S-3.csv").write_text(table)
    with pytest.raises(RecordingError, match=message):
        observe(asked, "S-3")


def test_a_wrong_file_of_one_recording_refuses_it_alone_and_a_right_one_is_for_no_study(asked: Study) -> None:
    plain = overlay(asked.config.to_plain(), {"cohort": str(asked.outside.folder), "subjects": "all"})
    with pytest.raises(ConfigError, match=r"s_2x.yaml: says how one recording was made.*leave the subject"):
        load_study(plain)
    (asked.outside.folder / "swe" / "s_2x.yaml").write_text("protocol: { phases: 3 }\n")
    again = load_study(asked.config.to_plain(), new_cohort=asked.outside.folder)
    assert tuple(again.outside.rows) == ("S-1", "S-3")
    assert "protocol.phases" in again.outside.refused["s_2x"]


def test_residuals_that_no_heart_makes_have_a_small_p_value() -> None:
    gated = speed_case.model()
    predicted = gated.predict(speed_case.PHI[None].repeat(200, axis=0))
    rng = np.random.default_rng(0)

    def p_value(of: SpeedModel, errors_log_sd: float) -> float:
        pushes = replace(of.recording, cell=np.arange(20), errors_log_sd=errors_log_sd)
        chi_squared = replace(of, recording=pushes).chi_squared(predicted, rng)
        return residuals_p_value(chi_squared, 20)

    assert p_value(gated, 0.0) > 0.05
    ragged = gated.recording.speed_m_s * np.exp(0.3 * rng.standard_normal(20))
    off = replace(gated, recording=replace(gated.recording, speed_m_s=ragged))
    assert p_value(off, 0.0) < 1e-3
    # where the errors may be larger than declared, the same residuals are no surprise
    assert p_value(off, 1.5) > 0.05
