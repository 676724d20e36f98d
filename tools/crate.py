"""Pack a finished study as an RO-Crate: ``python tools/crate.py RESULTS``, in the project's folder.

The crate is a folder with workflow, configuration, environment, recordings, tables and figures. Its
ro-crate-metadata.json says what each of them is, and that this workflow made these results of these
recordings (profile Workflow Run Crate 0.5).
"""

from __future__ import annotations

import argparse
import mimetypes
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final, cast

from rocrate.model.contextentity import ContextEntity
from rocrate.model.entity import Entity
from rocrate.rocrate import ROCrate

from swesbi import __version__
from swesbi.artefacts import ArtefactError
from swesbi.config.read import ConfigError, read_yaml

VERSION: Final = "1.1"
"""Of RO-Crate: the one that the profiles below extend."""
PROFILES: Final = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": "Workflow RO-Crate",
}
WORKFLOW_PROFILE: Final = "https://bioschemas.org/profiles/ComputationalWorkflow/1.0-RELEASE"
RUN: Final = "Snakemake ran the workflow on the recordings and wrote the results, under this configuration."
CODE_LICENCE: Final = "https://spdx.org/licenses/BSD-3-Clause"
DATA_LICENCE: Final = "https://spdx.org/licenses/CC-BY-4.0"
LICENCES: Final = {
    CODE_LICENCE: "BSD 3-Clause License, of the code",
    DATA_LICENCE: "Creative Commons Attribution 4.0 International, of shipped recordings and their results",
}
SHIPPED: Final = ("data/virtual_volunteers", "data/virtual_trial")
"""Cohorts whose licence is the project's to give; that of any other is its owner's."""
FORMATS: Final = {".yaml": "application/yaml", ".tex": "application/x-tex", ".md": "text/markdown"}
"""What Python's own table of formats does not know."""
CITATION: Final = Path("CITATION.cff")
BASE: Final = Path("config.yaml")
MERGED: Final = "configuration.yaml"
EXIT_USAGE: Final = 2
ENVIRONMENT: Final = ("environment.txt", "pyproject.toml")
ABOUT: Final = ("README.md", "LICENSE", "data/LICENSE", str(CITATION))
CODE: Final = {"workflow": "rules and scripts of the workflow", "src": "the package that the rules call"}
PASSING: Final = shutil.ignore_patterns("__pycache__", "*.egg-info", ".*")


@dataclass(frozen=True)
class CrateFiles:
    """Files of one run, relative to the project's folder: configuration, recordings with subjects, results.

    ``shipped`` says whether the recordings are those of the project.
    """

    settings: tuple[Path, ...]
    data: tuple[Path, ...]
    results: tuple[Path, ...]
    shipped: bool


def main(arguments: Sequence[str]) -> int:
    """Pack a study; return 0, or 2 after one message where it is not finished or has files elsewhere."""
    parser = argparse.ArgumentParser(prog="tools/crate.py", description=__doc__)
    parser.add_argument("results", type=Path, metavar="RESULTS", help="folder of results of the study")
    parser.add_argument("--out", type=Path, metavar="FOLDER", help="default: crate, in RESULTS")
    options = parser.parse_args(arguments)
    folder = options.out or options.results / "crate"
    try:
        packed = files_of(options.results)
        write_crate(packed, folder)
    except (ArtefactError, ConfigError, OSError) as error:
        print(f"crate: {error}", file=sys.stderr)
        return EXIT_USAGE
    print(f"wrote {folder}: {len(packed.data)} files of data, {len(packed.results)} of results")
    return 0


def files_of(results: Path) -> CrateFiles:
    """Return what is packed of a study, by its folder of results."""
    page, merged = results / "index.html", results / MERGED
    if not page.is_file():
        raise ArtefactError(f"{page} does not exist: finish the study first (make study)")
    cohort = Path(read_yaml(merged)["cohort"])
    recordings = [path for path in sorted(cohort.rglob("*")) if path.is_file() and path.suffix != ".py"]
    shown = chain.from_iterable(
        sorted((results / name).glob("*")) for name in ("tables", "figures", "report")
    )
    return CrateFiles((BASE, merged), tuple(recordings), (page, *shown), cohort.as_posix() in SHIPPED)


def write_crate(packed: CrateFiles, folder: Path) -> None:
    """Write the crate as a folder, whole or not at all; one that is there is replaced.

    The same files give the same bytes: the only date is that of the version, in ``CITATION.cff``.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}-") as temporary:
        written = Path(temporary) / folder.name
        described(packed).write(written)
        for name in CODE:
            shutil.copytree(name, written / name, ignore=PASSING, dirs_exist_ok=True)
        if folder.exists():
            shutil.rmtree(folder)
        written.rename(folder)


def described(packed: CrateFiles) -> ROCrate:
    """Return the crate: a workflow that has run, by the profiles above."""
    crate = ROCrate(version=VERSION)
    licences = (CODE_LICENCE, DATA_LICENCE) if packed.shipped else (CODE_LICENCE,)
    _describe_root(crate, read_yaml(CITATION), licences)
    workflow = _workflow(crate)
    settings = [_file(crate, path, CODE_LICENCE) for path in packed.settings]
    data = [_file(crate, path, *licences[1:]) for path in packed.data]
    results = [_file(crate, path, *licences[1:]) for path in packed.results]
    action = _context(crate, "#run", "CreateAction", "Run of the study", description=RUN)
    action["instrument"], action["object"], action["result"] = workflow, [*settings, *data], results
    action["actionStatus"] = "http://schema.org/CompletedActionStatus"
    crate.root_dataset["mentions"] = action
    return crate


def _describe_root(crate: ROCrate, citation: Mapping[str, Any], licences: Sequence[str]) -> None:
    """Say what the whole is: title, version, date, authors, licences, profiles."""
    root = crate.root_dataset
    root["name"], root["description"] = citation["title"], " ".join(citation["abstract"].split())
    root["version"], root["datePublished"] = str(citation["version"]), str(citation["date-released"])
    root["keywords"] = ", ".join(citation["keywords"])
    (author,) = (each["name"] for each in citation["authors"])
    root["author"] = _context(crate, f"#{author.lower().replace(' ', '-')}", "Organization", author)
    root["publisher"] = root["author"]
    root["license"] = [_context(crate, url, "CreativeWork", LICENCES[url]) for url in licences]
    root["conformsTo"] = [
        _context(crate, url, "CreativeWork", name, version=url.rpartition("/")[2])
        for url, name in PROFILES.items()
    ]


def _context(crate: ROCrate, name: str, kind: str, title: str, **further: str) -> Entity:
    """Add an entity that is no file: a licence, a profile, an author."""
    said = {"@type": kind, "name": title, **further}
    return cast(Entity, crate.add(ContextEntity(crate, name, properties=said)))


def _workflow(crate: ROCrate) -> Entity:
    """Add the Snakefile, the folders that it needs, and the files that say what it runs in."""
    said = {"name": "The whole study", "encodingFormat": "text/plain", "license": {"@id": CODE_LICENCE}}
    workflow = crate.add_workflow("Snakefile", "Snakefile", main=True, lang="snakemake", properties=said)
    workflow["conformsTo"], workflow["version"] = {"@id": WORKFLOW_PROFILE}, __version__
    workflow["hasPart"] = [
        crate.add_dataset(dest_path=f"{name}/", properties={"name": what}) for name, what in CODE.items()
    ]
    workflow["softwareRequirements"] = [_file(crate, Path(name), CODE_LICENCE) for name in ENVIRONMENT]
    readme, *_ = [_file(crate, Path(name), CODE_LICENCE) for name in ABOUT]
    readme["about"] = crate.root_dataset
    return cast(Entity, workflow)


def _file(crate: ROCrate, path: Path, licence: str = "") -> Entity:
    """Add a file at the place that it has in the project, with its licence where that is known."""
    here, place = Path.cwd(), path.resolve()
    if not place.is_relative_to(here):
        raise ArtefactError(f"{path}: lies outside of {here}, so that no crate of the project can name it")
    kind = FORMATS.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "text/plain"
    said: dict[str, Any] = {"name": path.name, "encodingFormat": kind}
    said |= {"license": {"@id": licence}} if licence else {}
    within = place.relative_to(here).as_posix()
    return cast(Entity, crate.add_file(path, within, properties=said, record_size=True))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
