"""A headless Chromium driven through its DevTools protocol: what a page loads, shows and complains of."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
import websocket

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",  # as root, in a container, there is no other way
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--allow-file-access-from-files",
    "--remote-debugging-port=0",
    "--remote-allow-origins=*",
)
PATIENCE_S = 240.0  # axe-core takes a minute for a page of 16,000 elements beside other tests
SERIOUS = ("serious", "critical")
AXE = files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RUN = """axe.run(document, {resultTypes: ['violations'], preload: false})
    .then(found => found.violations.map(one => [one.impact, one.id, one.nodes[0].html]))"""
OPEN = "document.querySelectorAll('details').forEach(part => part.open = true)"


class Browser:
    """One page of a running browser."""

    def __init__(self, address: str) -> None:
        self._socket = websocket.create_connection(address, timeout=PATIENCE_S)
        self._last = 0
        self.complaints: list[str] = []
        self.requests: list[str] = []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: object) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        self._last += 1
        self._socket.send(json.dumps({"id": self._last, "method": method, "params": parameters}))
        while True:
            message = self._receive()
            if message.get("id") == self._last:
                assert "error" not in message, f"{method}: {message.get('error')}"
                result: dict[str, Any] = message["result"]
                return result

    def open(self, page: Path, width_px: int, height_px: int = 900) -> None:
        """Open a local page in a window of this size and wait until it has loaded."""
        size = {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        self.complaints.clear()
        self.requests.clear()
        self.call("Page.navigate", url=page.resolve().as_uri())
        while self._receive().get("method") != "Page.loadEventFired":
            pass
        self.settle()

    def settle(self) -> None:
        """Wait until scripts that are due and the frame after them have run."""
        two_frames = "requestAnimationFrame(() => requestAnimationFrame(done))"
        self.evaluate(f"new Promise(done => setTimeout(() => {two_frames}, 200))")

    def evaluate(self, expression: str) -> Any:  # noqa: ANN401
        """Return the value of a JavaScript expression, awaited if it is a promise."""
        done = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def close(self) -> None:
        """Close the browser."""
        with suppress(OSError, websocket.WebSocketException):
            self.call("Browser.close")
        self._socket.close()

    def _receive(self) -> dict[str, Any]:
        message: dict[str, Any] = json.loads(self._socket.recv())
        self._note(str(message.get("method", "")), message.get("params", {}))
        return message

    def _note(self, event: str, content: dict[str, Any]) -> None:
        """Keep what the page asks for, and every error that it or the browser reports."""
        if event == "Network.requestWillBeSent":
            self.requests.append(content["request"]["url"])
        elif (
            event == "Runtime.exceptionThrown"
            or (event == "Runtime.consoleAPICalled" and content["type"] in {"error", "assert"})
            or (event == "Log.entryAdded" and content["entry"]["level"] == "error")
            or (event == "Network.loadingFailed" and not content.get("canceled"))
        ):
            self.complaints.append(json.dumps(content))


def until(page: Browser, condition: str, patience_s: float = PATIENCE_S) -> None:
    """Wait until a condition in JavaScript holds; fail with it where it does not in time."""
    limit = time.monotonic() + patience_s
    while not page.evaluate(f"Boolean({condition})"):
        assert time.monotonic() < limit, condition
        time.sleep(0.05)


def serious(page: Browser) -> list[list[str]]:
    """What keeps people from using the open page, all of it unfolded: impact, rule, first element."""
    page.evaluate(OPEN)
    page.settle()
    # the page's own policy forbids it to run code from elsewhere, which this is not
    page.evaluate(f"{AXE}; 0")
    found: list[list[str]] = page.evaluate(RUN)
    return [one for one in found if one[0] in SERIOUS]


def in_dark(page: Browser, *, dark: bool) -> None:
    """Let the page believe that its reader prefers dark colours, or not."""
    features: list[dict[str, Any]] = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
    page.call("Emulation.setEmulatedMedia", features=features)


def find_browser(names: Sequence[str] = NAMES) -> str:
    """Return the browser's program; skip the test where there is none, but fail in CI."""
    for name in names:
        if program := shutil.which(name):
            return program
    reason = f"no browser found ({', '.join(names)}); on Debian: apt-get install chromium"
    if os.environ.get("CI") == "true":
        pytest.fail(reason)
    pytest.skip(reason)


@contextmanager
def browser() -> Iterator[Browser]:
    """Run a browser with a new profile of its own."""
    program = find_browser()
    with tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True) as profile:
        command = [program, *FLAGS, f"--user-data-dir={profile}", "about:blank"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            page = Browser(_page_address(Path(profile) / "DevToolsActivePort", process))
            try:
                yield page
            finally:
                page.close()
            with suppress(subprocess.TimeoutExpired):
                process.wait(timeout=10)
        finally:
            process.kill()
            process.wait()


def _page_address(file: Path, process: subprocess.Popen[bytes]) -> str:
    """Return the WebSocket address of the browser's page, once it has written its port."""
    limit = time.monotonic() + PATIENCE_S
    while time.monotonic() < limit and process.poll() is None:
        if file.is_file() and len(lines := file.read_text().splitlines()) == 2:
            with urlopen(f"http://127.0.0.1:{lines[0]}/json/list", timeout=PATIENCE_S) as told:
                pages = [target for target in json.load(told) if target["type"] == "page"]
            return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(0.05)
    raise AssertionError(f"the browser did not start within {PATIENCE_S:g} s (exit code {process.poll()})")
