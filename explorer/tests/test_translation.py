"""The translator: functions give what Python gives, and what it does not know is refused with its place."""

from __future__ import annotations

import textwrap
from pathlib import Path

import numpy as np
import pytest
from javascript import evaluate, find_node
from scipy import special, stats
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.special import logsumexp, ndtr, ndtri

from explorer.translation import modules
from explorer.translation.library import runtime
from explorer.translation.program import LATER, Program
from explorer.translation.refusal import UntranslatableError
from swesbi.base.terminal import printable
from swesbi.posterior.diagnostics import smooth
from swesbi.recording.tables.table import spelling


@pytest.fixture(autouse=True)
def program() -> str:
    """Skip these tests where there is no Node.js; fail in CI."""
    return find_node()


def translated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str) -> str:
    """Return the function ``f`` of a module as JavaScript."""
    file = tmp_path / "toy.py"
    file.write_text("import numpy as np\n" + textwrap.dedent(code))
    monkeypatch.setattr(modules, "file_of", lambda name: file)  # noqa: ARG005
    modules.module.cache_clear()
    made = Program()
    made.reference(("swesbi.toy", "f"))
    modules.module.cache_clear()
    return made.text()


GENERIC = """
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar, runtime_checkable
T = TypeVar("T")
class N(Protocol):
    @property
    def h(self): "It."
@runtime_checkable
class P(N, Protocol):
    def g(self): "It."
class A(Generic[T]):
    @property
    def h(self):
        raise NotImplementedError
    def g(self):
        return 2 * self.h
"""


@pytest.mark.parametrize(
    ("code", "given", "expected"),
    [
        ("def f(x):\n    return [k ** 2 // 3 for k in x if k % 2]", [[1, 2, 3, 5]], [0, 3, 8]),
        ("def f(x):\n    return {k: y for k in x if (y := 2 * k) > 2}[3]", [[1, 2, 3]], 6),
        (
            "def f(x):\n    y = np.array(x)\n    return np.einsum('...pr,...r->...p', y, y[:1]).tolist()",
            [[[1.0, 2.0], [3.0, 4.0]]],
            [[5, 11]],
        ),
        ("def f(x):\n    a, *b, c = x\n    return [a, b, -7 % c, -7 // c]", [[1, 2, 4]], [1, [2], 1, -2]),
        ("def f(x):\n    return x or 'none'", [""], "none"),
        ("def f(x):\n    return 1 <= x < 3", [2], True),
        ("def f(x):\n    return f'{x:.3g} {x:.2f} {x:.0%} {x:g}'", [0.125], "0.125 0.12 12% 0.125"),
        ("def f(x):\n    y = np.array(x)\n    y[1:] += y[0]\n    return y.tolist()", [[1.0, 2.0]], [1, 3]),
        ("def f(x):\n    y = np.array(x)\n    return y[y > 1.5].sum()", [[1.0, 2.0, 3.0]], 5),
        (
            "def f(x):\n    y = np.array(x)\n    return (y[:, None] * y[[1, 0], None].T).tolist()",
            [[1.0, 2.0]],
            [[2, 1], [4, 2]],
        ),
        ("def f(x):\n    d = {'b': x, 'a': 2 * x}\n    return [*d, *d.values()]", [1], ["b", "a", 1, 2]),
        ("def f(x, y=2, *, z=3):\n    return g(x, z=y)-z\ndef g(a, b=5, z=0):\n    return a*b + z", [1], 4),
        (
            "def f(x):\n    for k in range(x):\n        if k == 3:\n            break\n    else:\n"
            "        return 'whole'\n    return k",
            [5],
            3,
        ),
        (
            f"{GENERIC}@dataclass\nclass B(A[int]):\n    x: int\n    @property\n    def h(self):\n"
            "        return self.x\n@dataclass\nclass C:\n    g: int\n"
            "def f(x):\n    b = B(x)\n    return [b.g(), isinstance(b, P), isinstance(C(x), P)]",
            [4],
            [8, True, False],
        ),
    ],
)  # fmt: skip
def test_functions_give_what_python_gives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, given: list[object], expected: object
) -> None:
    scope: dict[str, object] = {"np": np}
    exec(code, scope)  # noqa: S102
    assert scope["f"](*given) == expected  # type: ignore[operator]
    assert (
        evaluate(tmp_path, translated(tmp_path, monkeypatch, code), "return f(...given);", given) == expected
    )


@pytest.mark.parametrize(
    ("code", "line", "what"),
    [
        ("def f(x):\n    return np.fft.fft(x)", 3, "numpy.fft.fft"),
        ("def f(x):\n    y = x\n    return y.unheard_of()", 4, "the method unheard_of"),
        ("def f(x):\n    with open(x) as y:\n        return y", 3, "open(x)"),
        ("def f(x):\n    global y\n    y = x", 3, "Global"),
        ("def f(x):\n    return x << 2", 3, "the operator LShift"),
        ("def f(x):\n    return who + x", 3, "the name who"),
        ("def f(**x):\n    return x", 2, "a function of any arguments"),
        ("def f(x):\n    return g(x, b=1)\ndef g(a):\n    return a", 3, "the argument b"),
        (
            "def f(x):\n    return g(*x, b=1)\ndef g(a, b):\n    return a",
            3,
            "a call by name behind arguments",
        ),
        (
            "def f(x):\n    return B(x)\nclass A:\n    y: int\nclass B(A[int]):\n    z: int",
            6,
            "A[int], a base with fields",
        ),
    ],
)
def test_what_is_not_known_is_refused_with_file_and_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str, line: int, what: str
) -> None:
    with pytest.raises(UntranslatableError) as refused:
        translated(tmp_path, monkeypatch, code)
    assert str(refused.value).startswith(f"{tmp_path / 'toy.py'}:{line}: {what}")


LIBRARIES = """
const array = (list) => np.array(list);
const arrays = Object.entries(given).map(([name, list]) => [name, array(list)]);
const { levels, x, nodes, rows } = Object.fromEntries(arrays);
const closed = [...given.rows[0], given.rows[0][0]].map((y) => [y]), periodic = kw({ bc_type: "periodic" });
const stacked = array(given.stacked), last = kw({ axis1: 1, axis2: 2 });
const kept = kw({ axis: 1, keepdims: true });
const spline = interpolate.CubicSpline(array([...given.nodes, given.nodes[0] + 1]), array(closed), periodic);
const rows_of_two = getItem(rows, py.slice(null, 2), py.slice(null, 2));
const shape = array([[1.2, 0.3], [0.3, 0.8]]);
const student = new StudentLaw(array([0.1, -0.2]), shape, 8);
return {
  ndtr: special.ndtr(x).tolist(), ndtri: special.ndtri(levels).tolist(),
  gammaincinv: [0.3, 3].map((a) => special.gammaincinv(a, levels).tolist()),
  t: student.logpdf(array(given.pairs)).tolist(),
  chi2: [special.chdtrc(3, 7.3), special.chdtrc(5, 0.2)], gammaln: special.gammaln(array([0.5, 5])).tolist(),
  logsumexp: special.logsumexp(rows, kw({ axis: 0 })).tolist(),
  spline: np.reshape(spline(x_in), [-1]).tolist(), slope: np.reshape(spline(x_in, 1), [-1]).tolist(),
  pchip: interpolate.PchipInterpolator(nodes, rows, kw({ axis: 1 }))(x_in).tolist(),
  quantile: np.quantile(rows, array([0.05, 0.5, 0.95]), kw({ axis: 1 })).tolist(),
  kept: special.logsumexp(rows, kept).tolist(), norm: np.linalg.norm(rows, kept).tolist(),
  solve: np.linalg.solve(array([[[2, 1], [1, 3]]]), array([[[1], [2]]])).tolist(),
  inv: np.linalg.inv(stacked).tolist(), cholesky: np.linalg.cholesky(stacked).tolist(),
  diagonal: np.diagonal(stacked, last).tolist(), trace: np.trace(stacked, last).tolist(),
  dstack: np.dstack([stacked, rows_of_two]).tolist(),
};
"""


def test_what_stands_for_libraries_gives_what_they_give(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    levels, x = np.linspace(0.001, 0.999, 21), np.linspace(-3.0, 3.0, 21)
    levels[[0, -1]] = 1e-12, 1.0 - 1e-12
    stacked = np.array([[[2.0, 1.0], [1.0, 3.0]], [[1.0, -0.2], [-0.2, 0.5]]])
    nodes = np.sort(rng.random(9)) * 0.9
    rows = rng.random((3, 9))
    pairs = rng.standard_normal((5, 2))
    inside = np.linspace(nodes[1], nodes[-2], 13)
    given = {
        "levels": levels,
        "x": x,
        "nodes": nodes,
        "rows": rows,
        "pairs": pairs,
        "inside": inside,
        "stacked": stacked,
    }
    body = "const x_in = np.array(given.inside);" + LIBRARIES
    plain = {name: values.tolist() for name, values in given.items()}
    found = evaluate(tmp_path, runtime() + LATER, body, plain)
    spline = CubicSpline(np.append(nodes, nodes[0] + 1), np.append(rows[0], rows[0, 0]), bc_type="periodic")
    expected = {
        "ndtr": ndtr(x),
        "ndtri": ndtri(levels),
        "gammaincinv": [special.gammaincinv(a, levels) for a in (0.3, 3.0)],
        "t": stats.multivariate_t([0.1, -0.2], [[1.2, 0.3], [0.3, 0.8]], df=8).logpdf(pairs),
        "chi2": [special.chdtrc(3, 7.3), special.chdtrc(5, 0.2)],
        "gammaln": special.gammaln([0.5, 5.0]),
        "logsumexp": logsumexp(rows, axis=0),
        "spline": spline(inside),
        "slope": spline(inside, 1),
        "pchip": PchipInterpolator(nodes, rows, axis=1)(inside),
        "quantile": np.quantile(rows, [0.05, 0.5, 0.95], axis=1),
        "kept": logsumexp(rows, axis=1, keepdims=True),
        "solve": [[[0.2], [0.6]]],
        "inv": np.linalg.inv(stacked),
        "cholesky": np.linalg.cholesky(stacked),
        "norm": np.linalg.norm(rows, axis=1, keepdims=True),
        "diagonal": np.diagonal(stacked, axis1=1, axis2=2),
        "trace": np.trace(stacked, axis1=1, axis2=2),
        "dstack": np.dstack([stacked, rows[:2, :2]]),
    }
    for name, values in expected.items():
        np.testing.assert_allclose(found[name], values, rtol=1e-11, atol=1e-13, err_msg=name)


@pytest.mark.parametrize("size", [4, 40, 4000])
def test_smoothed_weights_are_pythons(tmp_path: Path, size: int) -> None:
    made = Program()
    made.reference(("swesbi.posterior.diagnostics", "smooth"))
    ratios = np.random.default_rng(1).standard_t(3, size)
    body = "const [weights, k] = smooth(np.array(given)); return [weights.tolist(), String(k)];"
    found, k_hat = evaluate(tmp_path, made.text(), body, ratios.tolist())
    weights, expected = smooth(ratios)
    np.testing.assert_allclose(found, weights, rtol=1e-11)
    assert float(k_hat.replace("Infinity", "inf")) == pytest.approx(expected, rel=1e-9)


def test_signs_that_cannot_be_printed_are_pythons(tmp_path: Path) -> None:
    texts = ["plain β\n\t", "\x1b[2J\r", "\u200b\u2028\xa0", "\U000e0001", "Müller-Å 007", "--", "A\u030a"]
    body = "return given.map((text) => [printable(text), spelling(text)]);"
    found = evaluate(tmp_path, runtime() + LATER, body, texts)
    assert found == [[printable(text), spelling(text)] for text in texts]
