"""Write an empty, commented cohort to be filled with recordings."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Final

from swesbi.artefacts.atomic import folder_made_whole, typed
from swesbi.base.terminal import EXIT_REFUSED
from swesbi.context import CONTEXT
from swesbi.recording.cohort.clinical import CLINICAL
from swesbi.recording.cohort.files import RECORDING_FILE, RECORDINGS, SUBJECTS
from swesbi.recording.cohort.visits import VISITS

NAME: Final = "letters, digits, - and _; the recording is swe/<subject>.csv or swe/<subject>.mat"
TEMPLATES: Final = {
    RECORDING_FILE: "recording.yaml",
    f"{RECORDINGS}/_example.csv": "example.csv",
    f"{RECORDINGS}/_example_free.csv": "example_free.csv",
}


def main(options: argparse.Namespace) -> int:
    """Run `template`; return 0, or 2 where there is something already or nothing can be made."""
    if options.like is not None:
        # readers of tables take a third of a second to import, and an empty cohort needs none
        from swesbi.recording.tables.propose import as_yaml, proposal_for

        print(as_yaml(options.like, proposal_for(options.like)), end="")
        return 0
    folder: Path = options.cohort
    if folder.is_symlink() or (folder.exists() and not (folder.is_dir() and not any(folder.iterdir()))):
        return _refuse(
            f"{folder}: is there already, and is left as it is; name a folder that is new or empty"
        )
    try:
        written = write_template(folder)
    except FileNotFoundError as error:  # a folder of the system's own, /proc say, takes no further ones
        return _refuse(f"{folder}: cannot be made ({error.strerror}); name a folder on a disk")
    for path in written:
        print(f"wrote {path}")
    print(f"Fill them in, add swe/<subject>.csv, .mat or .xlsx, then: {typed('swesbi', 'validate', folder)}")
    return 0


def _refuse(message: str) -> int:
    print(f"swesbi: {message}", file=sys.stderr)
    return EXIT_REFUSED


def write_template(folder: Path) -> list[Path]:
    """Write the files of an empty cohort, and return their paths."""
    templates = files("swesbi.recording.cohort").joinpath("templates")
    texts = {name: templates.joinpath(file).read_text(encoding="utf-8") for name, file in TEMPLATES.items()}
    texts = {SUBJECTS: empty_subjects()} | texts
    with folder_made_whole(folder) as made:
        (made / RECORDINGS).mkdir()
        for name, text in texts.items():
            (made / name).write_text(text, encoding="utf-8", newline="\n")
    return [folder / name for name in texts]


def empty_subjects() -> str:
    """Return a ``subjects.csv`` without a row, which says what belongs in each column."""
    asked = {"subject": NAME} | {variable.column: variable.asked for variable in CONTEXT}
    optional = {column.name: f"{column.asked}, {column.example} say" for column in (*CLINICAL, *VISITS)}
    lines = (
        "# One row per subject, below the row of names. Lines that begin with # are ignored, and so are "
        "further columns.",
        *_in_columns(asked),
        "# A row looks like this:",
        f"# {','.join(['S01', *(variable.example for variable in CONTEXT)])}",
        "# Optional columns; name them in the row of names too. An empty cell was not measured, or says "
        "nothing.",
        *_in_columns(optional),
        ",".join(asked),
    )
    return "".join(f"{line}\n" for line in lines)


def _in_columns(asked: Mapping[str, str]) -> list[str]:
    width = max(map(len, asked)) + 2
    return [f"# {column:<{width}}{what}" for column, what in asked.items()]
