"""Store the first screens of README, results and interactive model as figures of the documentation.

``python benchmarks/first_screens.py [results]`` needs Chromium and a finished study.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from markdown_it import MarkdownIt

SIZES: Final = {"desktop": (1400, 900), "phone": (400, 800)}
ROOT: Final = Path(__file__).resolve().parent.parent
STYLE: Final = (
    "body{font:16px/1.5 sans-serif;max-width:900px;margin:1.5em auto;padding:0 1em}img{max-width:100%}"
    "pre{background:#f4f4f4;padding:.8em;overflow:auto}td,th{border:1px solid #ccc;padding:.3em .6em}"
    "table{border-collapse:collapse;display:block;overflow:auto}"
)


def main(results: Path) -> None:
    """Write ``docs/figures/screen-*.png``.

    Raises:
        SystemExit: There is no browser, or no page.
    """
    program = shutil.which("chromium")
    if program is None:
        raise SystemExit("no browser found (chromium); on Debian: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder:
        pages = {"results": results / "index.html", "explorer": results / "explorer.html"}
        if absent := [page for page in pages.values() if not page.is_file()]:
            raise SystemExit(f"{absent[0]} does not exist: finish the study first (make study)")
        pages["readme"] = rendered(ROOT / "README.md", Path(folder) / "readme.html")
        for name, page in pages.items():
            for size, (width_px, height_px) in SIZES.items():
                png = ROOT / "docs" / "figures" / f"screen-{name}-{size}.png"
                take(program, page, png, width_px, height_px)


def rendered(markdown: Path, html: Path) -> Path:
    """Write a page of Markdown as HTML, with its pictures where they lie, and return its path."""
    body = MarkdownIt("commonmark").enable("table").render(markdown.read_text(encoding="utf-8"))
    head = f'<!doctype html><meta charset="utf-8"><base href="{ROOT.as_uri()}/"><style>{STYLE}</style>'
    html.write_text(f"{head}<body>{body}", encoding="utf-8")
    return html


def take(program: str, page: Path, png: Path, width_px: int, height_px: int) -> None:
    """Photograph the page's first screen; a frame has its width, since no window is as narrow as a phone.

    Raises:
        subprocess.CalledProcessError: The browser failed.
    """
    frame = (
        '<body style="margin:0"><iframe style="border:0;display:block" '
        f'width="{width_px}" height="{height_px}" src="{page.resolve().as_uri()}"></iframe>'
    )
    with tempfile.TemporaryDirectory() as folder:
        outer = Path(folder) / "frame.html"
        outer.write_text(frame, encoding="utf-8")
        options = ("--headless=new", "--no-sandbox", "--hide-scrollbars", f"--user-data-dir={folder}/profile")
        budget = "--virtual-time-budget=15000"  # the interactive model compiles and runs before it shows
        where = (budget, f"--window-size={width_px},{height_px}", f"--screenshot={png}", outer.as_uri())
        subprocess.run([program, *options, *where], check=True, capture_output=True)
    print(f"wrote {png}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
