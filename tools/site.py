"""The pages as a searchable site that needs no network: ``python -m tools.site`` writes build/docs-site/.

Sphinx reads a copy of the repository's files, so that links of pages lead where they do there. Beside it
stands what is made of the code: help texts, settings, and the public interface.
"""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stdout, suppress
from pathlib import Path
from typing import Final
from unittest.mock import patch

import swesbi
from swesbi.__main__ import COMMANDS
from swesbi.__main__ import main as swesbi_command
from tools.settings import SECTION, Row, rows

ROOT: Final = Path(__file__).parents[1]
SOURCE: Final = ROOT / "build" / "docs-source"
SITE: Final = ROOT / "build" / "docs-site"
README: Final = Path("README.md")
NO_PAGE: Final = (README, Path("CHANGELOG.md"))
"""The first page, and what is left out (docs/site/conf.py)."""
PAGES: Final = (
    "tutorial",
    "own-data",
    "compare-and-plan",
    "results",
    "run-and-scale",
    "configuration",
    "model",
    "inference",
    "population",
    "validation",
    "reproduction",
    "comparison",
    "faq",
)
"""The pages of docs/ in the order in which they are read; others come behind them."""
PLAIN: Final = str.maketrans({"<": "&lt;"})
INDEX: Final = '<!doctype html><meta http-equiv="refresh" content="0; url=README.html"><title>swesbi</title>'


def write_source(folder: Path) -> None:
    """Lay out what Sphinx reads, in an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    listed = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    files = [Path(name) for name in sorted(names) if (ROOT / name).is_file()]
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / file, folder / file)
    (folder / "reference").mkdir()
    reference = {"commands": _commands(), "settings": _settings(), "interface": _interface()}
    for name, lines in reference.items():
        (folder / "reference" / f"{name}.md").write_text("\n".join(lines), encoding="utf-8")
    pages = [file.with_suffix("") for file in files if file.suffix == ".md" and file not in NO_PAGE]
    first = [Path("docs", name) for name in PAGES if Path("docs", name) in pages]
    rest = [page for page in pages if page.parent.name == "docs" and page not in first]
    contents = {
        "Documentation": [*first, *rest],
        "Reference": [Path("reference", name) for name in reference],
        "Studies, data and code": [page for page in pages if page not in (*first, *rest)],
    }
    text = (folder / README).read_text(encoding="utf-8")
    for caption, under in contents.items():
        entries = "\n".join(map(str, under))
        text += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{entries}\n```\n"
    (folder / README).write_text(text, encoding="utf-8")


def _commands() -> Iterator[str]:
    yield "# Commands\n"
    for command in ("", *COMMANDS):
        shown = io.StringIO()
        # a parser ends the program behind its help
        with redirect_stdout(shown), suppress(SystemExit), patch.dict(os.environ, COLUMNS="90"):
            swesbi_command([*command.split(), "--help"])
        yield f"## {' '.join(['swesbi', *command.split()])}\n\n```text\n{shown.getvalue().rstrip()}\n```\n"


def _settings() -> Iterator[str]:
    yield "# Settings\n\nThe same is [a table of comma-separated values](../docs/tables/settings.csv)."
    yield "Behind each key stand its shipped value, its unit and its allowed range."
    sections: dict[tuple[str, str], list[Row]] = {}
    for row in rows():
        name = row.key.partition(".")[0] if "." in row.key or row.allowed == SECTION else ""
        sections.setdefault((row.file, name), []).append(row)
    last = ""
    for (file, name), of_section in sections.items():
        yield f"\n## {file}" if file != last else ""
        yield f"\n### {name}\n" if name else ""
        last = file
        for row in of_section:
            default = f" = `{row.default}`" if row.default else ""
            allowed = ", ".join([*([row.unit] if row.unit not in ("", "1") else []), row.allowed])
            source = f"Source: {row.source}." if row.source else ""
            yield f"`{row.key}`{default} ({allowed})"
            yield f": {' '.join(filter(None, (row.meaning, row.reason, source)))}\n".translate(PLAIN)


def _interface() -> Iterator[str]:
    yield "# Python interface\n\n```{eval-rst}"
    for name in swesbi.__all__:
        public = getattr(swesbi, name)
        if isinstance(public, type):
            yield f".. autoclass:: swesbi.{name}\n   :members:\n   :exclude-members: model_config\n"
        else:
            yield f".. autofunction:: swesbi.{name}\n"
    yield "```"


def main() -> int:
    """Write the site; return 0, or the code with which Sphinx ends after a warning."""
    write_source(SOURCE)
    options = ["--quiet", "--fail-on-warning", "--keep-going", "--conf-dir", str(ROOT / "docs" / "site")]
    command = [sys.executable, "-m", "sphinx", *options, str(SOURCE), str(SITE)]
    code = subprocess.run(command, check=False).returncode
    if code == 0:
        (SITE / "index.html").write_text(INDEX, encoding="utf-8")
        print(f"wrote {SITE}/index.html")
    return code


if __name__ == "__main__":
    sys.exit(main())
