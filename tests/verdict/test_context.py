from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from swesbi.context import Context
from swesbi.verdict.context import context_tests, leave_one_out

LEVEL = 0.01


def healthy_context(i: int) -> Context:
    return Context(
        f"H{i}", "F", 20.0 + i, 1.6 + 0.05 * i, 60.0 + 2 * i, 80.0 + 5 * i, 30.0 + 2 * i, 0.68 + 0.02 * i
    )


def test_a_subject_unlike_the_others_is_found_where_pooled_z_scores_cannot() -> None:
    healthy = [healthy_context(i) for i in range(5)]
    thick = Context("P", "F", 23.0, 1.7, 64.0, 90.0, 34.0, 1.4)
    values = np.array([one.ivsd_cm for one in (*healthy, thick)])
    assert abs((1.4 - values.mean()) / values.std()) < np.sqrt(5) + 1e-9
    left_out, ranges = context_tests(thick, healthy, healthy, LEVEL)
    assert left_out.flagged
    assert "ivsd_cm = 1.4" in left_out.detail
    assert ranges.flagged
    assert "ivsd_cm = 1.4 lies outside 0.68 to 0.76" in ranges.detail
    others = (*healthy[:2], *healthy[3:])
    assert not any(test.flagged for test in context_tests(healthy[2], others, others, LEVEL))


def test_few_others_leave_the_reach_of_null_recordings() -> None:
    one = Context("A", "F", 23.0, 1.7, 64.0, 90.0, 34.0, 0.8)
    assert [test.name for test in context_tests(one, (one, one), (one,), LEVEL)] == ["context_ranges"]


def test_leave_one_out_p_values_are_uniform() -> None:
    draws = np.random.default_rng(8).standard_normal((2000, 6, 1))
    p = [leave_one_out(sample[0], sample[1:])[1][0] for sample in draws]
    assert kstest(p, "uniform").pvalue > 0.01
    same = leave_one_out(np.array([1.0, 2.0]), np.ones((4, 2)))[1]
    assert same == pytest.approx([1.0, 0.0])
