"""Store the first screens of README, results and interactive model as figures of the documentation.

``python benchmarks/first_screens.py [results]`` needs Chromium and a finished study.
"""

from __future__ import annotations

import base64
import sys
import tempfile
from pathlib import Path
from typing import Final

from markdown_it import MarkdownIt

ROOT: Final = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

from browser import Browser, browser, until  # noqa: E402

SIZES: Final = {"desktop": (1400, 900), "phone": (400, 800)}
DRAWN: Final = {"explorer": "document.body.dataset.drawn && document.body.dataset.answered"}
"""When a page is complete, if that is later than when it is loaded."""
STYLE: Final = (
    "body{font:16px/1.5 sans-serif;max-width:900px;margin:1.5em auto;padding:0 1em}img{max-width:100%}"
    "pre{background:#f4f4f4;padding:.8em;overflow:auto}td,th{border:1px solid #ccc;padding:.3em .6em}"
    "table{border-collapse:collapse;display:block;overflow:auto}"
)


def main(results: Path) -> None:
    """Write ``docs/figures/screen-*.png``.

    Raises:
        SystemExit: There is no page.
    """
    with tempfile.TemporaryDirectory() as folder, browser() as page:
        pages = {"results": results / "index.html", "explorer": results / "explorer.html"}
        if absent := [path for path in pages.values() if not path.is_file()]:
            raise SystemExit(f"{absent[0]} does not exist: finish the study first (make study)")
        pages["readme"] = rendered(ROOT / "README.md", Path(folder) / "readme.html")
        for name, path in pages.items():
            for size, (width_px, height_px) in SIZES.items():
                page.open(path, width_px, height_px)
                until(page, DRAWN.get(name, "true"))
                take(page, ROOT / "docs" / "figures" / f"screen-{name}-{size}.png")


def rendered(markdown: Path, html: Path) -> Path:
    """Write a page of Markdown as HTML, with its pictures where they lie, and return its path."""
    body = MarkdownIt("commonmark").enable("table").render(markdown.read_text(encoding="utf-8"))
    head = f'<!doctype html><meta charset="utf-8"><base href="{ROOT.as_uri()}/"><style>{STYLE}</style>'
    html.write_text(f"{head}<body>{body}", encoding="utf-8")
    return html


def take(page: Browser, png: Path) -> None:
    """Save the part of the page that its window shows."""
    png.write_bytes(base64.b64decode(page.call("Page.captureScreenshot")["data"]))
    print(f"wrote {png}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
