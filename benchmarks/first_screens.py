"""Store the first screens of the results, on a desktop and on a phone, as figures of the documentation.

``python benchmarks/first_screens.py [results]`` needs Chromium and a finished study.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

SIZES: Final = {"desktop": (1400, 900), "phone": (400, 800)}
FIGURES: Final = Path(__file__).resolve().parent.parent / "docs" / "figures"


def main(results: Path) -> None:
    """Write ``docs/figures/first-screen-*.png``.

    Raises:
        SystemExit: There is no browser, or no page.
    """
    program, page = shutil.which("chromium"), results / "index.html"
    if program is None:
        raise SystemExit("no browser found (chromium); on Debian: apt-get install chromium")
    if not page.is_file():
        raise SystemExit(f"{page} does not exist: finish the study first (make study)")
    for name, (width_px, height_px) in SIZES.items():
        take(program, page, FIGURES / f"first-screen-{name}.png", width_px, height_px)


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
        where = (f"--window-size={width_px},{height_px}", f"--screenshot={png}", outer.as_uri())
        subprocess.run([program, *options, *where], check=True, capture_output=True)
    print(f"wrote {png}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
