"""How fast the page of the explorer answers: a slider, and the posterior of each subject's recording.

    python -m explorer.benchmark results/explorer.html

Needs a Chromium; times hold for a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "helpers"))

from browser import Browser, browser

MOVES = 20
MOVE = """(async () => {
  const answered = document.body.dataset.answered, slider = document.getElementById("k_sr_per_s"), began = performance.now();
  slider.value = String(Number(slider.value) - 0.005);
  slider.dispatchEvent(new Event("input"));
  while (document.body.dataset.answered === answered) await new Promise((go) => setTimeout(go, 0));
  return performance.now() - began;
})()"""  # noqa: E501
CHOOSE = "document.getElementById('subject').value = '{}'; document.getElementById('subject').dispatchEvent(new Event('change'))"  # noqa: E501


def waited(page: Browser, condition: str) -> None:
    """Wait until a condition holds."""
    while not page.evaluate(f"Boolean({condition})"):
        time.sleep(0.05)


def main() -> None:
    """Print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", type=Path)
    file = parser.parse_args().page
    with browser() as page:
        page.open(file, 1400)
        waited(page, "document.body.dataset.drawn")
        times = [page.evaluate(MOVE) for _ in range(MOVES)]
        print(f"slider: first {times[0]:.0f} ms, median {statistics.median(times):.0f} ms")
        for number, name in enumerate(page.evaluate("study.subjects.map(subject => subject.name)")):
            page.evaluate(CHOOSE.format(number))
            page.evaluate("document.getElementById('infer').click()")
            waited(page, f"document.body.dataset.inferred === {name!r}")
            print(f"{name}: {page.evaluate('document.getElementById(`sampling`).textContent')}", flush=True)


if __name__ == "__main__":
    main()
