"""Nothing is executed from data, no pickle is read or written, and no stage needs the network."""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from study_copy import ROOT, StudyCopy, copy_study

from swesbi.config.read import ConfigError, read_yaml

FORBIDDEN = {
    "eval": "executes text",
    "exec": "executes text",
    "compile": "executes text",
    "__import__": "imports by name",
    "os.system": "runs a shell",
    "os.popen": "runs a shell",
    "pickle.load": "loads a pickle",
    "pickle.loads": "loads a pickle",
    "pickle.Unpickler": "loads a pickle",
    "pd.read_pickle": "loads a pickle",
    "torch.load": "loads a pickle",
    "torch.save": "writes a pickle",
    "joblib.load": "loads a pickle",
    "yaml.load": "builds any object; yaml.safe_load does not",
    "yaml.unsafe_load": "builds any object",
    "yaml.full_load": "builds objects",
}
NETWORK = {"socket", "urllib", "http", "requests", "ftplib", "smtplib", "aiohttp", "httpx"}
SOURCES = sorted([*(ROOT / "src").rglob("*.py"), *(ROOT / "workflow").rglob("*.py")])


def calls(path: Path) -> Iterator[tuple[str, ast.Call]]:
    """Yield the calls in a module with the dotted name of what is called."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def keyword(call: ast.Call, name: str) -> object:
    """Return a keyword of a call if it is a constant, or None."""
    values = [each.value for each in call.keywords if each.arg == name]
    return values[0].value if values and isinstance(values[0], ast.Constant) else None


def faults(path: Path) -> list[str]:
    """Return what a module does that could execute data."""
    found = []
    for name, call in calls(path):
        if name in FORBIDDEN:
            found.append(f"{path}:{call.lineno}: {name} {FORBIDDEN[name]}")
        if name.endswith("np.load") and keyword(call, "allow_pickle"):
            found.append(f"{path}:{call.lineno}: np.load with allow_pickle")
        if keyword(call, "shell") is True:
            found.append(f"{path}:{call.lineno}: {name} with a shell")
    return found


def network_uses(path: Path) -> list[str]:
    """Return the imports of network modules; the name of this machine is no network."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = {name.split(".")[0] for node in ast.walk(tree) for name in imported_names(node)}
    used = {name.removeprefix("socket.") for name, _ in calls(path) if name.startswith("socket.")}
    own_name_alone = used <= {"gethostname"} and "socket" in imported
    return sorted((imported & NETWORK) - ({"socket"} if own_name_alone else set()))


def imported_names(node: ast.AST) -> list[str]:
    """Return the modules that one statement imports."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    return [node.module or ""] if isinstance(node, ast.ImportFrom) else []


def test_no_module_loads_pickles_or_executes_text() -> None:
    assert len(SOURCES) > 100
    assert [fault for path in SOURCES for fault in faults(path)] == []


def test_no_module_uses_the_network() -> None:
    assert {str(path): uses for path in SOURCES if (uses := network_uses(path))} == {}


@pytest.mark.parametrize(
    "line",
    [
        "pickle.loads(b'')",
        "torch.load('x.pt')",
        "torch.load('x.pt', weights_only=True)",
        "np.load('x', allow_pickle=True)",
        "subprocess.run('ls', shell=True)",
        "yaml.load(text)",
        "eval('1')",
    ],
)
def test_the_search_finds_what_it_looks_for(tmp_path: Path, line: str) -> None:
    (tmp_path / "module.py").write_text(f"{line}\n")
    assert faults(tmp_path / "module.py")


def test_the_search_for_network_modules_finds_them(tmp_path: Path) -> None:
    for line in (
        "import urllib.request",
        "from http import client",
        "import socket\nsocket.create_connection(1)",
    ):
        (tmp_path / "module.py").write_text(f"{line}\n")
        assert network_uses(tmp_path / "module.py"), line


def test_nothing_in_a_configuration_is_executed(tmp_path: Path) -> None:
    trace, path = tmp_path / "executed", tmp_path / "config.yaml"
    path.write_text(f"seed: !!python/object/apply:pathlib.Path.touch [!!python/name:x '{trace}']\n")
    with pytest.raises(ConfigError, match=r"config\.yaml"):
        read_yaml(path)
    assert not trace.exists()


RULES = ("ingest", "passive", "simulate", "posterior")
DENIED = '''"""Imported by every Python process of the test: whoever opens a connection is stopped."""
import socket
def denied(*arguments, **options):
    raise OSError("the network is denied")
for name in ("connect", "connect_ex", "sendto"):
    setattr(socket.socket, name, denied)
socket.getaddrinfo = socket.create_connection = denied
'''


@pytest.mark.slow
def test_core_stages_run_without_the_network(own_study: StudyCopy, tmp_path: Path) -> None:
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(DENIED)
    study = own_study
    environment = {**study.environment, "PYTHONPATH": f"{tmp_path / 'site'}:{study.folder / 'src'}"}
    probe = [sys.executable, "-c", "import socket; socket.create_connection(('127.0.0.1', 1))"]
    stopped = subprocess.run(probe, env=environment, capture_output=True, text=True, check=False)
    assert "the network is denied" in stopped.stderr
    targets = [
        study.results / "cohort" / "A" / "observation.h5",
        study.results / "cohort" / "A" / "passive.h5",
        study.results / "simulations" / "paper" / "A" / "shard-0.h5",
        study.results / "paper" / "subjects" / "A" / "posterior.h5",
    ]
    for target in targets:
        target.unlink()
    names = [str(target.relative_to(study.folder)) for target in targets]
    # only what was removed: the pool is not made again for an observation that is newer
    command = [*study.command(*names), "--rerun-triggers", "input", "--allowed-rules", *RULES]
    done = subprocess.run(
        command, cwd=study.folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert all(target.is_file() for target in targets)


@pytest.mark.exhaustive  # CI makes the small study of all its tests in such a namespace
def test_the_study_runs_in_a_namespace_without_network(tmp_path: Path) -> None:
    unshare = ["unshare", "--net"]
    if shutil.which("unshare") is None or subprocess.run([*unshare, "true"], check=False).returncode != 0:
        pytest.skip("network namespaces are not permitted here")
    study: StudyCopy = copy_study(tmp_path)
    done = subprocess.run(
        [*unshare, *study.command()],
        cwd=study.folder,
        env=study.environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (study.results / "index.html").is_file()
