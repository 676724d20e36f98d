"""Run the cells of a notebook in their order, and keep in it what each prints and draws.

python -m tools.notebook docs/examples/laboratory.ipynb
"""

from __future__ import annotations

import argparse
import base64
import io
import json
from collections.abc import Iterator, Mapping
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl

from swesbi.artefacts import atomic_path

DPI: Final = 110


def outputs(notebook: Mapping[str, Any]) -> Iterator[list[dict[str, Any]]]:
    """Run the code cells in one namespace; yield the outputs of each, as a notebook keeps them."""
    mpl.use("agg")
    import matplotlib.pyplot as plt  # which takes the backend

    names: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate(code_cells(notebook), start=1):
        said, kept = io.StringIO(), list[dict[str, Any]]()
        with redirect_stdout(said):
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
        if text := said.getvalue():
            kept.append({"output_type": "stream", "name": "stdout", "text": text.splitlines(keepends=True)})
        for figure in map(plt.figure, plt.get_fignums()):
            drawn = io.BytesIO()
            figure.savefig(drawn, dpi=DPI, metadata={"Software": None})
            image = {"image/png": base64.b64encode(drawn.getvalue()).decode()}
            kept.append({"output_type": "display_data", "data": image, "metadata": {}})
        plt.close("all")
        yield kept


def code_cells(notebook: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the cells that run."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def printed(cell_outputs: list[dict[str, Any]]) -> str:
    """Return what a cell prints, of its outputs."""
    return "".join("".join(each["text"]) for each in cell_outputs if each["output_type"] == "stream")


def main() -> None:
    """Run a notebook and write it with its outputs."""
    parser = argparse.ArgumentParser(prog="python -m tools.notebook", description=__doc__.splitlines()[0])
    parser.add_argument("notebook", type=Path, help="an .ipynb file, which is written anew")
    path = parser.parse_args().notebook
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for number, (cell, kept) in enumerate(zip(code_cells(notebook), outputs(notebook), strict=True), start=1):
        cell |= {"execution_count": number, "outputs": kept}
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
