"""The explorer in a browser: it moves with its sliders, says what Python says, and asks for nothing."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import explorer_case
import numpy as np
import pytest
import speed_case
from browser import Browser, in_dark, serious, until

from explorer.data import DRAWS, page_data, spread
from explorer.page import LARGEST_BYTES, render_page
from explorer.physics import physics
from swesbi.heart.simulate import simulate
from swesbi.measurement.likelihood import SpeedModel
from swesbi.measurement.speeds import measured_speeds
from swesbi.posterior.adaptive import adaptive_rounds
from swesbi.posterior.hearts import HeartModel
from swesbi.posterior.importance import resample

ANSWERED = "Number(document.body.dataset.answered ?? 0)"
STATUS = "document.getElementById('status').textContent"


def test_the_page_is_one_small_file_that_names_no_address() -> None:
    page = explorer_case.page()
    assert len(page.encode()) < LARGEST_BYTES
    assert not re.findall(r"https?://|@import|url\(|<link rel=.stylesheet", page)
    assert re.findall(r"<script[^>]* src=|<img", page) == []
    assert "connect-src" not in page  # what the policy does not name is forbidden by its default
    assert "default-src 'none'" in page


def test_the_same_study_makes_the_same_page() -> None:
    settings = speed_case.settings("calibrated")
    subjects = [explorer_case.explored(name) for name in "AB"]
    data = page_data(subjects, explorer_case.COHORT_NOISE, settings, speed_case.shipped().recording, 1)
    assert (
        render_page(explorer_case.WORDS, data, physics(settings, speed_case.exact(), speed_case.rule()))
        == explorer_case.page()
    )


def test_error_bars_are_those_of_stiffness() -> None:
    """A speed off by its standard error makes a stiffness, 3 rho c2, that is off by the error bar."""
    settings = speed_case.settings("calibrated")
    subjects = [explorer_case.explored("A")]
    data = page_data(subjects, explorer_case.COHORT_NOISE, settings, speed_case.shipped().recording, 1)
    shown = data["subjects"][0]["recording"]
    stiffness, bar = np.array(shown["stiffness_kpa"]), np.array(shown["stiffness_se_kpa"])
    errors = measured_speeds(explorer_case.observation("A"), explorer_case.NOISE).errors.total
    faster = 3.0 * (np.array(shown["speed_m_s"]) * (1.0 + errors)) ** 2
    np.testing.assert_allclose(faster - stiffness, bar, rtol=0.05)


def test_a_page_that_is_too_large_is_refused() -> None:
    with pytest.raises(ValueError, match="more than 2000000; show fewer subjects"):
        render_page(explorer_case.WORDS, {"filler": "x" * LARGEST_BYTES}, "")


def test_draws_are_spread_over_all_that_there_are() -> None:
    phi = np.arange(1000.0)[:, None]
    assert len(spread(phi)) == DRAWS
    assert spread(phi)[0, 0] == 0.0
    assert spread(phi)[-1, 0] == 999.0
    np.testing.assert_array_equal(spread(phi[:7]), phi[:7])


def asked(page: Browser, task: str, given: object) -> Any:  # noqa: ANN401
    return page.evaluate(f"ask({task!r}, {json.dumps(given)})")


def pressed(page: Browser, key: str) -> None:
    for kind in ("keyDown", "keyUp"):
        named = {"key": key, "code": key, "windowsVirtualKeyCode": KEYS[key]}
        page.call("Input.dispatchKeyEvent", type=kind, **named)


KEYS = {"ArrowRight": 39, "Escape": 27}


@pytest.mark.exhaustive(minutes=0.2)
def test_beats_of_the_page_are_pythons(page: Browser) -> None:
    settings = speed_case.settings("calibrated")
    subject = explorer_case.explored("A")
    phi, context = subject.posterior.phi[:10], subject.observation.context
    given = {"phi": phi.tolist(), "context": page.evaluate("study.subjects[0].context")}
    found = asked(page, "beats", given)
    beats = simulate(phi[:, :3], context, settings.forward_model, settings.physiology(phi))
    for name, own in (("volume", beats.volume_ml), ("pressure", beats.ventricular_pressure_mmhg)):
        np.testing.assert_allclose(found[name], own, rtol=1e-9, atol=1e-9 * np.abs(own).max())
    assert found["beats"] == beats.beats.tolist()


@pytest.mark.exhaustive(minutes=0.2)
@pytest.mark.parametrize("name", ["k_sr_per_s", "speed_scale", "hr_bpm"])
def test_a_slider_moves_the_curves_by_the_keyboard(page: Browser, name: str) -> None:
    page.evaluate("document.querySelectorAll('details').forEach(part => part.open = true)")
    before, answered = page.evaluate("state.own.stiffness[0]"), page.evaluate(ANSWERED)
    page.evaluate(f"document.getElementById({name!r}).focus()")
    for _ in range(20):
        pressed(page, "ArrowRight")
    until(page, f"{ANSWERED} > {answered}")
    page.settle()
    assert np.abs(np.array(page.evaluate("state.own.stiffness[0]")) - before).max() > 0.1
    assert page.evaluate(STATUS).startswith("Periodic after")


@pytest.mark.exhaustive(minutes=0.2)
def test_what_is_brushed_is_picked_everywhere(page: Browser) -> None:
    draws = np.array(page.evaluate("study.subjects[0].draws"))
    assert page.evaluate("document.body.dataset.chosen") == str(len(draws))
    low, high = page.evaluate("[study.parameters[0].low, study.parameters[0].high]")
    page.evaluate("document.querySelector('#theta canvas').focus()")
    pressed(page, "ArrowRight")  # a window from .42 to .62 of the slider
    place = np.log(draws[:, 0] / low) / np.log(high / low)
    in_window = (place >= 0.42) & (place <= 0.62)
    assert page.evaluate("document.body.dataset.chosen") == str(in_window.sum())
    page.evaluate("plots.stiffness.box = [0.3, 0.4, 0, 25]; drawAll()")
    phase, stiffness = (np.array(page.evaluate(f"state.posterior.{name}")) for name in ("phase", "stiffness"))
    passes = ((stiffness <= 25.0) & (phase >= 0.3) & (phase <= 0.4)).any(axis=1)
    assert 0 < (in_window & passes).sum() < in_window.sum()
    assert page.evaluate("document.body.dataset.chosen") == str((in_window & passes).sum())
    pressed(page, "Escape")
    assert page.evaluate("document.body.dataset.chosen") == str(passes.sum())


@pytest.mark.exhaustive(minutes=1)
def test_the_posterior_of_a_recording_is_pythons(page: Browser, tmp_path: Path) -> None:
    """Two independent runs of one algorithm: a classifier cannot tell the draws apart."""
    page.evaluate("document.getElementById('infer').click()")
    until(page, "document.body.dataset.inferred", 240.0)
    told = page.evaluate("document.getElementById('sampling').textContent")
    assert told.startswith("Reliable: Pareto shape 0.")
    found = np.array(page.evaluate("state.inferred.phi"))
    observed, settings = explorer_case.observation("A"), speed_case.settings("calibrated")
    model = SpeedModel(measured_speeds(observed, explorer_case.NOISE), settings)
    *_, last = adaptive_rounds(HeartModel(model), speed_case.exact(), 2)
    own = resample(last.weighted, len(found), np.random.default_rng(1))
    error = 4.5 * np.sqrt(2.0 / speed_case.exact().min_effective_draws)
    spread = np.log(own).std(axis=0)
    np.testing.assert_allclose(
        (np.log(found).mean(axis=0) - np.log(own).mean(axis=0)) / spread, 0.0, atol=error
    )
    np.testing.assert_allclose(np.log(found).std(axis=0) / spread, 1.0, atol=error)
    assert found.shape == (speed_case.exact().draws, len(settings.prior.parameters))
    inside, phases = page.evaluate("[state.inferred.check.inside, state.inferred.check.phases]")
    assert phases == observed.measured.sum()
    assert inside >= 0.75 * phases
    csv = page.evaluate(
        "fetch(document.getElementById('download').href).then(got => got.text(), error => null)"
    )
    assert csv is None  # not even of its own: the policy names no connection
    rows = page.evaluate("csvOf(state.inferred)").splitlines()
    assert rows[0].split(",") == list(settings.prior.names)
    np.testing.assert_allclose([float(cell) for cell in rows[1].split(",")], found[0])
    tests = page.evaluate("[...document.querySelectorAll('#tests li')].map(line => line.textContent)")
    assert [line.split(":")[0] for line in tests] == [
        "residuals",
        "end diastolic volume",
        "end systolic volume",
    ]
    assert re.match(
        "No verdict|Doubtful|Contradicted", page.evaluate("document.getElementById('judged').textContent")
    )
    page.complaints.clear()  # of the fetch that the policy refused


@pytest.mark.exhaustive(minutes=0.2)
def test_an_inference_can_be_stopped_and_the_sliders_go_on_meanwhile(page: Browser) -> None:
    page.evaluate("document.getElementById('infer').click()")
    answered = page.evaluate(ANSWERED)
    page.evaluate("moved()")
    until(page, f"{ANSWERED} > {answered}")
    assert page.evaluate("document.body.dataset.inferred ?? null") is None
    page.evaluate("document.getElementById('stop').click()")
    assert page.evaluate("inferring") is None
    assert not page.evaluate("document.getElementById('infer').disabled")


@pytest.mark.exhaustive(minutes=0.2)
def test_a_heart_that_is_none_is_refused_in_pythons_words(page: Browser) -> None:
    page.evaluate("state.context.ivsd_cm = 3; state.context.lvedv_ml = 12; moved()")
    until(page, f"{STATUS}.startsWith('subject A')")
    assert page.evaluate(STATUS).endswith("expected 0.04 to 1; check both units")
    assert page.evaluate("state.own") is None


@pytest.mark.exhaustive(minutes=0.2)
def test_another_subject_brings_its_heart_and_its_recording(page: Browser) -> None:
    answered = page.evaluate(ANSWERED)
    page.evaluate("document.getElementById('subject').value = '1'")
    page.evaluate("document.getElementById('subject').dispatchEvent(new Event('change'))")
    until(page, f"{ANSWERED} > {answered}")
    observed = explorer_case.observation("B")
    assert page.evaluate("document.getElementById('hr_bpm-value').value") == f"{observed.context.hr_bpm:g}"
    assert page.evaluate("document.getElementById('verdict').textContent").startswith("B is not contradicted")
    points = page.evaluate("plots.stiffness.layers.find(layer => layer.error).y")
    np.testing.assert_allclose(points, observed.stiffness_kpa[observed.measured], rtol=1e-5)


@pytest.mark.exhaustive(minutes=0.2)
@pytest.mark.parametrize("width_px", [400, 1400])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_fits_the_window_and_its_colours_the_hour(
    opened: tuple[Browser, Path], width_px: int, scheme: str
) -> None:
    page, file = opened
    in_dark(page, dark=scheme == "dark")
    page.open(file, width_px, 800)
    until(page, "document.body.dataset.drawn && document.body.dataset.answered")
    assert not page.evaluate("document.documentElement.scrollWidth > document.documentElement.clientWidth")
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert (ground == "rgb(255, 255, 255)") == (scheme == "light")
    ink = page.evaluate("colour('ink')")
    assert ink == {"light": "#1a1a1a", "dark": "#ececec"}[scheme]
    unnamed = (
        "[...document.querySelectorAll('input, select, canvas, button')].filter(part => !(part.labels?.length"
        " || part.getAttribute('aria-label') || part.textContent)).map(part => part.outerHTML)"
    )
    assert page.evaluate(unnamed) == []
    assert page.complaints == []
    assert serious(page) == []
    page.call("Emulation.setEmulatedMedia", features=[])
