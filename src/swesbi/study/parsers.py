"""The options of every command, apart from what the commands do: `--help` imports no library for arrays."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import Final

DEMO_OUT: Final = "swesbi-demo"
ARTEFACTS: Final = (".h5", ".json")
"""Endings of files that have a checksum."""
LineByLine: Final = partial(argparse.ArgumentParser, formatter_class=argparse.RawDescriptionHelpFormatter)
"""A parser whose help keeps the lines of its texts."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--config`` and ``--overlay``, whose values ``read_merged`` takes."""
    parser.add_argument(
        "--config",
        type=Path,
        help="default: config.yaml, of this folder or else of the installed project; the study's paths count "
        "from its folder",
    )
    parser.add_argument("--overlay", type=Path, help="configuration merged over it (tests/smoke.yaml, say)")


def demo() -> argparse.ArgumentParser:
    """Return the options of `demo`."""
    parser = argparse.ArgumentParser(
        prog="swesbi demo",
        description="Infer a shipped recording of a virtual volunteer, whose true parameters are known. "
        "It needs no study: the network that comes with the package proposes first. "
        "The true parameters are printed beside the posterior.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path.cwd() / DEMO_OUT, help=f"folder; default: {DEMO_OUT}"
    )
    parser.add_argument("--config", type=Path, help=argparse.SUPPRESS)
    return parser


def template() -> argparse.ArgumentParser:
    """Return the options of `template`."""
    parser = LineByLine(
        prog="swesbi template",
        description="Write an empty folder for recordings, with comments that explain every column.\n"
        "It contains subjects.csv, recording.yaml and the header of a recording. Nothing is overwritten.\n"
        "With --like, propose how a table of another tool is read.",
        epilog="examples:\n  swesbi template data/my_cohort\n  swesbi template --like export.csv",
    )
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("cohort", type=Path, nargs="?", help="folder to make; it must be new or empty")
    asked.add_argument(
        "--like",
        type=Path,
        metavar="FILE",
        help="propose how the columns and units of a table (.csv, .xlsx) are read, for recording.yaml",
    )
    return parser


def validate() -> argparse.ArgumentParser:
    """Return the options of `validate`."""
    parser = LineByLine(
        prog="swesbi validate",
        description="Check a folder of recordings before inference.\n"
        "If there are problems, all are listed with file, row, column, value and remedy; exit code 2.\n"
        "If there are none, a table summarises each subject: phases, rejected samples with reasons, errors.\n"
        "Number of phases, density and quality control are set in `recording` of config.yaml.",
        epilog="example:\n  swesbi validate data/virtual_volunteers --plot sheets",
    )
    parser.add_argument("cohort", type=Path, help="folder with subjects.csv, recording.yaml and swe/")
    parser.add_argument("--phases", type=int, help="gated phases of a recording; default: as configured")
    parser.add_argument(
        "--plot", type=Path, metavar="FOLDER", help="write a figure of quality control per subject"
    )
    add_options(parser)
    return parser


def infer() -> argparse.ArgumentParser:
    """Return the options of `infer`."""
    parser = LineByLine(
        prog="swesbi infer",
        description="Infer recordings of a folder: those named, or all of them.\n"
        "Each has a posterior with diagnostics, a verdict, figures and a PDF sheet.\n"
        "A table lists all, where the folder is named.\n"
        "No study is needed: the network of the package gives the first proposal.\n"
        "Where a study has been run, its own networks do. The posterior is the same.\n"
        "A heart outside their range begins from the prior.\n"
        "Standard errors are estimated from the repeats of the folder.\n"
        "A gated recording has a row per sample, a free-running one a row per push.",
        epilog="examples:\n  swesbi infer data/virtual_volunteers/swe/G.csv\n"
        "  swesbi infer data/virtual_trial --workers 2\n\n"
        "Exit code: 0 all were inferred; 2 one was refused. The others of a folder are still inferred.",
    )
    parser.add_argument(
        "recordings",
        type=Path,
        nargs="+",
        help="recordings in FOLDER/swe/, or FOLDER with subjects.csv and recording.yaml",
    )
    parser.add_argument("--subject", help="one subject of the folder, or of its table of several")
    parser.add_argument("--from-prior", action="store_true", help="start from the prior, without a network")
    parser.add_argument("--workers", type=int, default=1, help="recordings inferred in parallel; default: 1")
    parser.add_argument(
        "--figures",
        choices=("none", "sheet", "all"),
        default="all",
        help="of each recording: none, the PDF sheet alone, or two images beside it; default: all",
    )
    _add_answering(parser, "answers/<folder>, with a folder per subject")
    parser.add_argument(
        "--force", action="store_true", help="infer again, and overwrite the answer to another recording"
    )
    return parser


def compare() -> argparse.ArgumentParser:
    """Return the options of `compare`."""
    parser = LineByLine(
        prog="swesbi compare",
        description="Infer what has changed between two visits of a person, or of all persons of a folder.\n"
        "The result is ratios of parameters with intervals, from the joint posterior of both recordings.\n"
        "The two visits share the quantities that a person keeps.\n"
        "Rows of subjects.csv with the same `person` are the visits. Each is also inferred as by `infer`.",
        epilog="examples:\n  swesbi compare --cohort data/virtual_trial --person P01\n"
        "  swesbi compare --cohort data/virtual_trial --all\n\n"
        "Exit code: 0 all were inferred; 2 one was refused, or groups failed. "
        "The others of --all are still inferred.",
    )
    parser.add_argument("--cohort", type=Path, required=True, help="folder with the recordings")
    asked = parser.add_mutually_exclusive_group(required=True)
    asked.add_argument("--person", help="one person of the folder")
    asked.add_argument(
        "--all",
        action="store_true",
        help="every person with two visits, and groups of them; writes changes.csv and changes_groups.* to "
        " <results>/<experiment>/change/ or in --out",
    )
    parser.add_argument(
        "--reference",
        metavar="GROUP",
        default="",
        help="with --all: the group that the others are compared with; default: that of the first row",
    )
    parser.add_argument("--from", dest="from_visit", metavar="VISIT", help="default: the first")
    parser.add_argument("--to", dest="to_visit", metavar="VISIT", help="default: the last")
    _add_answering(parser, "<results>/<experiment>/change/<person>")
    return parser


def _add_answering(parser: argparse.ArgumentParser, folder: str) -> None:
    """Add the options of commands that answer recordings outside the study into a folder."""
    parser.add_argument("--phases", type=int, help="gated phases of a recording; default: as configured")
    parser.add_argument(
        "--experiment",
        help="whose prior and network; default: the first of kind speeds, or one over a population where its "
        "network does not know the heart, or the prior",
    )
    parser.add_argument("--out", type=Path, help=f"folder; default: {folder}")
    add_options(parser)


def plan() -> argparse.ArgumentParser:
    """Return the options of `plan`."""
    parser = LineByLine(
        prog="swesbi plan",
        description="Estimate how many persons a study needs to find an effect, by number of repeats.\n"
        "Persons are simulated, recorded and inferred as real ones are. Many studies are drawn from them.\n"
        "They are inferred by the network of a population, that of the package where no study has been run.\n"
        "A person takes one to two minutes of one core for each number of repeats.\n"
        "Inferred persons are kept in <results>/<experiment>/plan/banks.",
        epilog="example:\n  swesbi plan --effect k_sr=-20% --repeats 3,5",
    )
    parser.add_argument("--effect", required=True, help="of one parameter: k_sr=-20%% (k0, k_atp, k_sr)")
    parser.add_argument(
        "--design",
        choices=("paired", "groups"),
        default="paired",
        help="two visits of each person (default), or one visit of two groups",
    )
    parser.add_argument("--repeats", default="3", help="at a phase; several are compared: 3,5,8; default: 3")
    parser.add_argument(
        "--noise", help="standard deviation of one repeat's speed at a phase, 3%%; default: as acquisition"
    )
    parser.add_argument("--power", help="share of studies that must find the effect; default: plan.power")
    parser.add_argument("--persons", type=int, help="also report the power of this number of persons")
    parser.add_argument("--bank", type=int, help="simulated persons; default: plan.persons.number")
    parser.add_argument("--experiment", help="one over a population; default: plan.experiment")
    parser.add_argument("--processes", type=int, default=2, help="persons inferred in parallel; default: 2")
    parser.add_argument(
        "--out", type=Path, help="folder; default: <results>/<experiment>/plan/<design>-<effect>"
    )
    add_options(parser)
    return parser


def inspect() -> argparse.ArgumentParser:
    """Return the options of `inspect`."""
    parser = argparse.ArgumentParser(
        prog="swesbi inspect",
        description="Summarise files of the study: what made them, and which arrays they contain. "
        f"Formats: {', '.join((*ARTEFACTS, '.csv', '.yaml'))}.",
        epilog="Exit code: 0 whole; 2 a file is damaged or cannot be read.",
    )
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="files of the study")
    parser.add_argument(
        "--check",
        action="store_true",
        help=f"only compare artefacts ({', '.join(ARTEFACTS)}) with their checksums; folders are searched",
    )
    return parser
