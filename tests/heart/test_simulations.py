from pathlib import Path

import numpy as np
import pytest
from forward_model_cases import COHORT, SETTINGS
from speed_case import shipped

from swesbi.artefacts import ArtefactError, Provenance
from swesbi.artefacts.typed import BySubject, read_as
from swesbi.config.view import shard_draws
from swesbi.heart import prior_simulations as draw
from swesbi.heart.periodic import Status
from swesbi.heart.prior_simulations import PriorSimulations, SimulationFailure, draw_simulations
from swesbi.prior import in_bounds

PRIOR = shipped().priors["paper"]
CONTEXT = COHORT["A"]


def simulate(draws: range, seed: int = 1) -> PriorSimulations:
    return draw_simulations(draws, CONTEXT, PRIOR, SETTINGS, seed)


def test_a_draw_is_the_same_in_whatever_shard_it_lies() -> None:
    whole = simulate(range(12))
    for shards in (1, 2, 5):
        parts = [simulate(shard_draws(shard, shards, 12)) for shard in range(shards)]
        np.testing.assert_array_equal(np.concatenate([part.theta for part in parts]), whole.theta)
        np.testing.assert_array_equal(
            np.concatenate([part.active_stiffness_kpa for part in parts]), whole.active_stiffness_kpa
        )
    assert in_bounds(whole.theta, PRIOR).all()
    assert not np.array_equal(simulate(range(12), seed=2).theta, whole.theta)


def test_shards_cover_every_draw_once_and_evenly() -> None:
    sizes = [len(shard_draws(shard, 7, 1000)) for shard in range(7)]
    assert sum(sizes) == 1000
    assert max(sizes) - min(sizes) <= 1
    with pytest.raises(ValueError, match="shard 7 does not exist"):
        shard_draws(7, 7, 1000)


def fail_some(monkeypatch: pytest.MonkeyPatch, fails: float) -> None:
    """Make the simulator report every beat with k_0 above ``fails`` as not periodic."""
    real = draw.simulate

    def failing(theta: np.ndarray, *arguments: object) -> object:
        beats = real(theta, *arguments)
        beats.status[theta[:, 0] > fails] = Status.NOT_PERIODIC
        return beats

    monkeypatch.setattr(draw, "simulate", failing)


def test_failures_are_counted_by_reason_and_redrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    clean = simulate(range(40))
    fail_some(monkeypatch, 45.0)
    redrawn = simulate(range(40))
    assert len(redrawn.theta) == 40
    assert (redrawn.theta[:, 0] <= 45.0).all()
    kept = clean.theta[:, 0] <= 45.0
    np.testing.assert_array_equal(redrawn.theta[kept], clean.theta[kept])
    np.testing.assert_array_equal(redrawn.attempts == 1, kept)
    np.testing.assert_array_equal(redrawn.failures[:, Status.NOT_PERIODIC], redrawn.attempts - 1)


def test_a_draw_that_always_fails_ends_with_an_explanation(monkeypatch: pytest.MonkeyPatch) -> None:
    fail_some(monkeypatch, 0.0)
    with pytest.raises(SimulationFailure, match=r"100 draws in a row .*not_periodic.*Narrow the prior"):
        simulate(range(3))


def write(path: Path, draws: range, subject: str = "A") -> Path:
    simulate(draws).write(path, Provenance("", subject))
    return path


def read(paths: list[Path]) -> PriorSimulations:
    return read_as(PriorSimulations, paths, "shards")


def test_shards_are_read_in_the_order_of_the_draws(tmp_path: Path) -> None:
    files = [write(tmp_path / "0.h5", range(4)), write(tmp_path / "1.h5", range(4, 9))]
    for order in (files, files[::-1]):
        np.testing.assert_array_equal(read(order).theta, simulate(range(9)).theta)
    assert PriorSimulations.load(files[0])[0]["/"]["theta"].attrs["units"] == "kPa, s-1, s-1"


def test_missing_doubled_or_foreign_shards_are_refused(tmp_path: Path) -> None:
    first = write(tmp_path / "0.h5", range(4))
    for wrong in ([first, first], [write(tmp_path / "2.h5", range(5, 9)), first]):
        with pytest.raises(ArtefactError, match="missing or doubled"):
            read(wrong)
    other = write(tmp_path / "other.h5", range(4, 9), subject="B")
    with pytest.raises(ArtefactError, match="several subjects"):
        read([first, other])
    assert BySubject("shards", [first, other], read).paths == {"A": [first], "B": [other]}
