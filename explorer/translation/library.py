"""What stands for functions of other packages and of Python itself in JavaScript (``runtime/``)."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Final


def _listed(words: str) -> tuple[str, ...]:
    return tuple(words.split())


OPERATORS: Final = {
    "Add": "add", "Sub": "sub", "Mult": "mul", "Div": "div", "FloorDiv": "floordiv", "Mod": "mod",
    "Pow": "pow", "MatMult": "matmul", "BitOr": "or_", "BitAnd": "and_", "BitXor": "xor",
}  # fmt: skip
COMPARISONS: Final = {"Lt": "lt", "LtE": "le", "Gt": "gt", "GtE": "ge", "Eq": "eq", "NotEq": "ne"}
BUILTINS: Final = {
    name: f"py.{name}"
    for name in _listed(
        """abs all any bool dict enumerate float getattr int isinstance len list map max min next range repr
        round set slice sorted str sum tuple type vars zip"""
    )
} | {name: name for name in ("ValueError", "KeyError", "UnicodeDecodeError")}
NUMPY: Final = _listed(
    """abs add.at all any append arange argmax argmin argsort array array_equal asarray ascontiguousarray
    bincount bool_ broadcast_arrays broadcast_to cbrt ceil clip column_stack concatenate count_nonzero
    cumsum delete diag diagonal diff dstack einsum empty empty_like exp expm1 eye flatnonzero float64 floor
    frombuffer full full_like hstack hypot inf int64 int8 interp isfinite isin isnan linalg.LinAlgError
    linalg.cholesky linalg.inv linalg.norm linalg.solve linspace log log10 log1p logaddexp max maximum mean
    median min minimum
    nan nan_to_num nanargmax nanmax nanmedian newaxis nextafter object_ ones ones_like pad pi power quantile
    random.default_rng repeat reshape rint roll round searchsorted sort sqrt square stack std str_ sum
    swapaxes tanh tile trace transpose unique vstack where zeros zeros_like"""
)
LIBRARY: Final = {
    "math.pi": "Math.PI",
    "math.inf": "Infinity",
    "math.isfinite": "Number.isFinite",
    "math.nan": "NaN",
    "math.hypot": "Math.hypot",
    "math.ceil": "Math.ceil",
    "math.log": "Math.log",
    "math.sqrt": "Math.sqrt",
    "re.fullmatch": "re.fullmatch",
    "difflib.get_close_matches": "difflib.get_close_matches",
    "dataclasses.fields": "py.fields",
    "dataclasses.replace": "py.replace",
    "scipy.interpolate.CubicSpline": "interpolate.CubicSpline",
    "scipy.interpolate.PchipInterpolator": "interpolate.PchipInterpolator",
    "statistics.NormalDist": "stats.NormalDist",
    "scipy.optimize.brentq": "optimize.brentq",
    **{
        f"scipy.special.{name}": f"special.{name}"
        for name in _listed("chdtrc expit gammaincinv gammaln log_expit logsumexp ndtr ndtri")
    },
    **{f"numpy.{name}": f"np.{name}" for name in NUMPY},
}
METHODS: Final = {
    name: name
    for name in _listed(
        """add all any append argmax argmin argsort astype clip copy count cumsum decode endswith extend find
        fit index inv_cdf item items keys logpdf lower max mean min normal permutation pop random removeprefix
        repeat reshape rvs split splitlines standard_normal startswith std strip sum swapaxes tobytes tolist
        transpose union update upper values var"""
    )
} | {"get": "found", "join": "joined", "replace": "replaceAll", "fromkeys": "fromkeys"}
"""Methods of arrays, texts and collections, whatever they are called on."""
RUNTIME: Final = (
    "runtime/arrays.js", "runtime/python.js", "runtime/numpy.js", "runtime/linear.js", "runtime/scipy.js",
    "runtime/random.js", "runtime/files.js",
)  # fmt: skip
WORDS: Final = _listed(
    """await break case catch class const continue debugger default delete do else enum export extends
    false finally for function if implements import in instanceof interface let new null package private
    protected public return static super switch this throw true try typeof var void while with yield
    arguments eval"""
)


def runtime() -> str:
    """Return what stands for Python and its libraries, as JavaScript."""
    folder = Path(__file__).parent
    return "\n".join((folder / name).read_text(encoding="utf-8") for name in RUNTIME)


@cache
def taken() -> frozenset[str]:
    """Return the names that JavaScript or the runtime have taken."""
    own = re.findall(r"^(?:function\*?|class|const|let) (\w+)", runtime(), re.MULTILINE)
    return frozenset((*WORDS, *own))


def identifier(name: str) -> str:
    """Return a name as JavaScript takes it."""
    return f"{name}_" if name in taken() else name
