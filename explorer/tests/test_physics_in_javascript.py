"""The page's physics, run by Node.js, gives the curves and likelihoods of Python, which it is made from."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import speed_case
from forward_model_cases import COHORT
from javascript import doubles, evaluate, find_node

from explorer.physics import physics
from swesbi.context import Context
from swesbi.heart.periodic import Status
from swesbi.heart.simulate import Beats, simulate
from swesbi.measurement.likelihood import SpeedModel
from swesbi.posterior.hearts import HeartModel
from swesbi.prior import sample

# the cohort of the paper, a slow thick heart and a fast small one
CONTEXTS = (
    *COHORT.values(),
    Context("G", "M", 60, 1.9, 50, 160, 70, 1.2),
    Context("H", "F", 45, 1.6, 95, 60, 20, 0.9),
)
CURVES = (
    "active_stiffness_kpa",
    "stretch",
    "volume_ml",
    "ventricular_pressure_mmhg",
    "arterial_pressure_mmhg",
    "aortic_flow_ml_s",
)
PARTS = """
const phi = np.array(given.phi), theta = getItem(phi, py.slice(null, null), py.slice(0, 3));
const context = (c) => call(physics.Context, [], c);
"""
SIMULATE = f"""{PARTS}
const {{ settings }} = physics;
for (const c of given.contexts) {{
  const beats = physics.simulate(theta, context(c), settings.forward_model, settings.physiology(phi));
  doubles(flat(beats.status));
  doubles(flat(beats.beats));
  for (const name of given.curves) doubles(flat(beats[name]));
}}
"""
MODEL = f"""{PARTS}
const r = given.recording, a = (list) => np.array(list);
const shared = r.columns ? a(r.shared) : np.empty([r.phase.length, 0]);
const measured = [a(r.phase), a(r.speed_m_s), a(r.relative_se), shared];
const recording = new physics.SpeedRecording(context(given.context), ...measured);
const model = new physics.SpeedModel(recording, physics.settings);
"""
LIKELIHOOD = f"{MODEL} doubles(flat(model.log_likelihood(phi)));"
HEARTS = f"""{MODEL}
const heart = new physics.HeartModel(model), points = heart.points(phi), found = heart.evaluated(points);
for (const part of [found.log_likelihood, found.log_likelihood_of_phi, found.phi]) doubles(flat(part));
"""
MODELS = pytest.mark.parametrize(
    "made", [speed_case.model(prior="calibrated"), speed_case.model_of_sweeps()], ids=["separate", "sweeps"]
)


@pytest.fixture(scope="module")
def program() -> str:
    """The physics of the experiment ``calibrated``, with all nuisance parameters."""
    find_node()
    return physics(speed_case.settings("calibrated"), speed_case.exact(), speed_case.rule())


def drawn(n: int) -> np.ndarray:
    return sample(n, speed_case.settings("calibrated").prior, np.random.default_rng(3))


def compared(
    program: str, folder: Path, n: int, contexts: tuple[Context, ...]
) -> list[tuple[Beats, np.ndarray]]:
    """Return Python's beats of each context and all that JavaScript says of them, (2 n + curves n M,)."""
    settings, phi = speed_case.settings("calibrated"), drawn(n)
    given = {"phi": phi.tolist(), "contexts": [asdict(context) for context in contexts], "curves": CURVES}
    evaluate(folder, program, SIMULATE, given)
    found = doubles(folder).reshape(len(contexts), -1)
    own = [
        simulate(phi[:, :3], context, settings.forward_model, settings.physiology(phi))
        for context in contexts
    ]
    return list(zip(own, found, strict=True))


def assert_same_curves(pairs: list[tuple[Beats, np.ndarray]], n: int) -> None:
    """Curves agree to 1e-9 of their largest value; with another number of beats, which is rare, to 1e-4."""
    other = 0
    for beats, found in pairs:
        np.testing.assert_array_equal(found[:n], beats.status)
        same = found[n : 2 * n] == beats.beats
        other += int(np.sum(~same))
        curves = found[2 * n :].reshape(len(CURVES), n, -1)
        done = beats.status == Status.PERIODIC
        for name, curve in zip(CURVES, curves, strict=True):
            own = getattr(beats, name)
            largest = np.abs(own[done]).max(axis=1)
            error = np.abs(curve[done] - own[done]).max(axis=1) / np.where(largest > 0.0, largest, 1.0)
            assert error[same[done]].max(initial=0.0) < 1e-9, name
            assert error.max(initial=0.0) < 1e-4, name
    assert other <= 0.002 * n * len(pairs)


def test_beats_are_those_of_python(program: str, tmp_path: Path) -> None:
    assert_same_curves(compared(program, tmp_path, 12, CONTEXTS), 12)


@pytest.mark.exhaustive(minutes=1)
def test_a_thousand_beats_of_eight_hearts_are_those_of_python(program: str, tmp_path: Path) -> None:
    assert_same_curves(compared(program, tmp_path, 1000, CONTEXTS), 1000)


def of_model(made: SpeedModel, folder: Path, body: str, phi: np.ndarray) -> np.ndarray:
    """Return the numbers that JavaScript has of phi (n, d) in a model."""
    find_node()
    recording = made.recording
    given = {
        "phi": phi.tolist(),
        "context": asdict(recording.context),
        "recording": {
            "phase": recording.phase.tolist(),
            "speed_m_s": recording.speed_m_s.tolist(),
            "relative_se": recording.relative_se.tolist(),
            "shared": recording.shared.tolist(),
            "columns": recording.shared.shape[1],
        },
    }
    evaluate(folder, physics(made.settings, speed_case.exact(), speed_case.rule()), body, given)
    return doubles(folder)


@MODELS
def test_likelihoods_are_those_of_python(made: SpeedModel, tmp_path: Path) -> None:
    phi = sample(40, made.settings.prior, np.random.default_rng(4))
    np.testing.assert_allclose(of_model(made, tmp_path, LIKELIHOOD, phi), made.log_likelihood(phi), rtol=1e-9)


@MODELS
def test_likelihoods_of_hearts_alone_are_those_of_python(made: SpeedModel, tmp_path: Path) -> None:
    """The numbers of a row are the same, so that estimates are, and which draw is taken."""
    phi = sample(40, made.settings.prior, np.random.default_rng(4))
    own = HeartModel(made).evaluated(made.settings.prior.heart(phi))
    expected = np.concatenate([own.log_likelihood, own.log_likelihood_of_phi, own.phi.ravel()])
    np.testing.assert_allclose(of_model(made, tmp_path, HEARTS, phi), expected, rtol=1e-9)


def test_other_equations_make_another_page(tmp_path: Path) -> None:
    """Options are decided when the page is made, so that a page of other equations simulates these."""
    find_node()
    settings = speed_case.settings()
    changes = {
        "length_dependence": 1.0,
        "valves": "inertance",
        "wall_inertia": True,
        "maximum_step_s": 1.4e-3,
    }
    other = settings.model_copy(update={"forward_model": settings.forward_model.model_copy(update=changes)})
    phi = sample(3, other.prior, np.random.default_rng(5))
    context = speed_case.CONTEXT
    given = {"phi": phi.tolist(), "contexts": [asdict(context)], "curves": CURVES}
    evaluate(tmp_path, physics(other, speed_case.exact(), speed_case.rule()), SIMULATE, given)
    beats = simulate(phi[:, :3], context, other.forward_model)
    assert_same_curves([(beats, doubles(tmp_path))], 3)
