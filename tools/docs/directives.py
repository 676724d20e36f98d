"""Tables of pages: a directive names a stored table, and what stands below it is written from that table.

A directive is the opening HTML comment of a part of a Markdown page, ``<!-- table PATH``, with keys in YAML;
the part ends with ``<!-- end table -->``. A column is named by its key, or made of several by a text with
their names in braces. ``wide`` makes one row of several: its columns are named by column and value.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import pandas as pd
import yaml
from pydantic import Field, ValidationError

from swesbi.base.settings import Settings
from swesbi.report.numbers import MINUS, MISSING, count, fixed, with_minus

PART: Final = re.compile(
    r"<!-- table (?P<path>[^\n]*)\n(?P<keys>(?:(?!-->).)*)-->\n"
    r"(?P<body>(?:(?!<!-- table ).)*?)<!-- end table -->",
    re.DOTALL,
)
MARK: Final = re.compile(r"<!-- (?:table |end table)")
STORED: Final = re.compile(r"(?:docs|studies/\w+)/tables/[\w./-]+\.csv")
HOLE: Final = re.compile(r"\{([^{}]*)\}")
MOST_ROWS: Final = 15
BAR: Final = "\\|"
QUERY_ERRORS: Final = (
    ArithmeticError, AttributeError, LookupError, NameError, NotImplementedError, SyntaxError, TypeError,
    ValueError,
)  # fmt: skip
"""What pandas raises of a query that it cannot answer."""

Place = Callable[[str], Path]
"""Where a file lies, by the path that a page names."""


class PageError(ValueError):
    """A page that cannot be filled; the message names page and line, what is wrong and what to do."""


class DirectiveError(ValueError):
    """A directive that cannot be followed; the message says what is wrong and what to do."""


class ShownColumn(Settings):
    """How a column is shown: its heading, the digits of its numbers, and words instead of values.

    ``digits`` are decimals, at most six significant digits by default; ``significant`` serves where sizes
    differ from row to row. With ``percent``, fractions are shown in percent.
    """

    head: str
    digits: int | None = Field(default=None, ge=0)
    significant: int | None = Field(default=None, ge=1)
    percent: bool = False
    words: dict[str, str] = Field(default_factory=dict)


class Wide(Settings):
    """One row for each value of the columns ``row``, with a column for each value of ``by``."""

    row: tuple[str, ...] = Field(min_length=1)
    by: str


class Directive(Settings):
    """The keys of a directive: which rows are shown, as pandas queries them, and columns from left to right.

    Rows are sorted by the columns of ``sort``, downwards by one with a minus before it.
    """

    where: str = ""
    wide: Wide | None = None
    sort: tuple[str, ...] = ()
    columns: dict[str, ShownColumn] = Field(min_length=1)


def filled(page: str, text: str, place: Place) -> str:
    """Return the text of a page with every table written anew from the stored ones."""
    pieces, end = [], 0
    for match in PART.finditer(text):
        _check_outside(page, text, end, match.start())
        try:
            table = markdown_of(match["path"].strip(), match["keys"], place)
        except DirectiveError as error:
            raise PageError(f"{page}:{line_of(text, match.start())}: {error}") from error
        pieces += [text[end : match.start("body")], f"\n{table}\n\n"]
        end = match.end("body")
    _check_outside(page, text, end, len(text))
    return "".join([*pieces, text[end:]])


def line_of(text: str, position: int) -> int:
    """Return the number of the line in which a position of a text lies, from 1."""
    return text.count("\n", 0, position) + 1


def _check_outside(page: str, text: str, start: int, end: int) -> None:
    """Refuse a mark outside the parts, but for the end of the part before."""
    begin = start + (text.startswith("<!-- end table", start) and start > 0)
    if mark := MARK.search(text, begin, end):
        raise PageError(
            f"{page}:{line_of(text, mark.start())}: the mark {mark[0].strip()!r} has no partner; "
            "a part is <!-- table PATH, keys, -->, its table and <!-- end table -->"
        )


def markdown_of(path: str, keys: str, place: Place) -> str:
    """Return the table of one directive as Markdown."""
    directive = _read(keys)
    if not STORED.fullmatch(path):
        raise DirectiveError(f"{path!r} is no stored table; name a CSV of docs/tables or of studies/*/tables")
    if not place(path).is_file():
        raise DirectiveError(f"{path} does not exist; `make docs` copies docs/tables/study/X from results/X")
    rows = _chosen(read_table(place(path)), directive, path)
    for key in directive.columns:
        _check_known(HOLE.findall(key) or [key], rows, path)
    columns = directive.columns.items()
    cells = [[_cell(row, key, shown) for key, shown in columns] for row in _rows(rows)]
    rules = ["---:" if _numeric(rows, key) else "---" for key, _ in columns]
    heads = [shown.head for _, shown in columns]
    return "\n".join([_line(heads), f"|{'|'.join(rules)}|", *map(_line, cells)])


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', BAR) for cell in cells)} |"


def read_table(path: Path) -> pd.DataFrame:
    """Read a table in which subjects and experiments are names, whatever they look like."""
    return pd.read_csv(path, converters={"subject": str, "experiment": str})


def _read(keys: str) -> Directive:
    try:
        return Directive.from_plain(yaml.safe_load(keys) or {})
    except yaml.YAMLError as error:
        raise DirectiveError(f"the keys are no YAML ({error}); quote texts with : or #") from error
    except ValidationError as error:
        found = "; ".join(f"{'.'.join(map(str, each['loc']))}: {each['msg']}" for each in error.errors())
        raise DirectiveError(f"{found}; the keys are where, wide, sort and columns") from error


def _chosen(table: pd.DataFrame, directive: Directive, path: str) -> pd.DataFrame:
    """Return the rows that are shown, in their order."""
    rows = table
    if directive.where:
        try:
            rows = table.query(directive.where, engine="python")
        except QUERY_ERRORS as error:
            raise DirectiveError(f"where: {error}; {path} has {_names(table)}") from error
    if rows.empty:
        raise DirectiveError(f"no row of {path} where {directive.where}; mend the query")
    if directive.wide:
        rows = _widened(rows, directive.wide, path)
    if directive.sort:
        names = [name.removeprefix("-") for name in directive.sort]
        _check_known(names, rows, path)
        upwards = [not name.startswith("-") for name in directive.sort]
        rows = rows.sort_values(names, ascending=upwards, kind="stable")
    if len(rows) > MOST_ROWS:
        raise DirectiveError(
            f"{len(rows)} rows of {path}, and {MOST_ROWS} are shown at most; narrow `where`, or link the CSV"
        )
    return rows


def _widened(rows: pd.DataFrame, wide: Wide, path: str) -> pd.DataFrame:
    """Return one row of several, in the order of the first of each."""
    keys, names = [*wide.row, wide.by], list(wide.row)
    _check_known(keys, rows, path)
    if rows.duplicated(keys).any():
        raise DirectiveError(f"wide: several rows of {path} have the same {', '.join(keys)}; narrow `where`")
    beside = rows.pivot(index=names, columns=wide.by)
    beside.columns = pd.Index([" ".join(map(str, pair)) for pair in beside.columns.tolist()])
    return rows[names].drop_duplicates().merge(beside, left_on=names, right_index=True)


def _check_known(names: list[str], table: pd.DataFrame, path: str) -> None:
    for name in names:
        if name not in table.columns:
            raise DirectiveError(f"no column of {path} is called {name!r}; it has {_names(table)}")


def _names(table: pd.DataFrame) -> str:
    return ", ".join(map(str, table.columns))


def _rows(rows: pd.DataFrame) -> Iterator[Mapping[str, Any]]:
    """Yield rows by name of the column; each column keeps its type."""
    columns = {str(name): rows[name].tolist() for name in rows.columns}
    return ({name: values[i] for name, values in columns.items()} for i in range(len(rows)))


def _numeric(rows: pd.DataFrame, key: str) -> bool:
    """Tell whether a column stands at the right."""
    names = HOLE.findall(key) or [key]
    return all(pd.api.types.is_numeric_dtype(rows[name]) and rows[name].dtype != bool for name in names)


def _cell(row: Mapping[str, Any], key: str, shown: ShownColumn) -> str:
    """Return a cell: a value, or a text with several; a dash where all of them are missing."""
    names = HOLE.findall(key)
    if not names:
        return _text(row[key], shown)
    texts = {name: _text(row[name], shown) for name in names}
    return MISSING if set(texts.values()) == {MISSING} else HOLE.sub(lambda hole: texts[hole[1]], key)


def _text(value: Any, shown: ShownColumn) -> str:  # noqa: ANN401
    """Return a value as a cell shows it."""
    if str(value) in shown.words:
        return shown.words[str(value)]
    if isinstance(value, str):
        return with_minus(value) or MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if pd.isna(value):
        return MISSING
    number = 100.0 * value if shown.percent else value
    if shown.digits is not None:
        return fixed(number, shown.digits)
    if shown.significant is None and float(number).is_integer():
        return count(number).replace("-", MINUS)
    return f"{number:.{shown.significant or 6}g}".replace("e+0", "e").replace("-", MINUS)
