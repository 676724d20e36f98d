"""Nothing is executed from data, no pickle is read or written, and no module uses the network."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from study_copy import ROOT

from swesbi.config.read import ConfigError, read_yaml

FORBIDDEN = {
    "eval", "exec", "compile", "__import__", "os.system", "os.popen",
    "pickle.load", "pickle.loads", "pickle.Unpickler", "pd.read_pickle", "joblib.load",
    "torch.load", "torch.save",
    "yaml.load", "yaml.unsafe_load", "yaml.full_load",
}  # fmt: skip
"""What executes text, loads a pickle or builds any object."""
NETWORK = {"urllib", "http", "requests", "ftplib", "smtplib", "aiohttp", "httpx"}
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
    """Return what a module does that could execute data, or reach the network."""
    found = sorted(imported_modules(path) & NETWORK)
    for name, call in calls(path):
        is_wrong = (
            name in FORBIDDEN
            or (name.endswith("np.load") and keyword(call, "allow_pickle"))
            or keyword(call, "shell") is True
            or (name.startswith("socket.") and name != "socket.gethostname")
        )
        if is_wrong:
            found.append(f"{path}:{call.lineno}: {name}")
    return found


def imported_modules(path: Path) -> set[str]:
    """Return the first part of the names of the modules that a module imports."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    return {name.partition(".")[0] for name in names}


def test_no_module_executes_data_or_uses_the_network() -> None:
    assert len(SOURCES) > 100
    assert [fault for path in SOURCES for fault in faults(path)] == []


def test_the_search_finds_what_it_looks_for(tmp_path: Path) -> None:
    for line in (
        "pickle.loads(b'')",
        "torch.load('x.pt')",
        "np.load('x', allow_pickle=True)",
        "subprocess.run('ls', shell=True)",
        "import urllib.request",
        "from http import client",
        "import socket\nsocket.create_connection(1)",
    ):
        (tmp_path / "module.py").write_text(f"{line}\n")
        assert faults(tmp_path / "module.py"), line


def test_nothing_in_a_configuration_is_executed(tmp_path: Path) -> None:
    trace, path = tmp_path / "executed", tmp_path / "config.yaml"
    path.write_text(f"seed: !!python/object/apply:pathlib.Path.touch [!!python/name:x '{trace}']\n")
    with pytest.raises(ConfigError, match=r"config\.yaml"):
        read_yaml(path)
    assert not trace.exists()
