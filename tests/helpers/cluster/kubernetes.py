"""A stand-in for a Kubernetes cluster: what Snakemake uses of its interface; pods are processes here.

What a pod's container is told to run runs in an empty folder, as in the volume that the plugin mounts. The
image is this interpreter's environment; persistent volumes are the folders that they would be mounted at.
"""

from __future__ import annotations

import base64
import contextlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

CONFIGURATION = """\
apiVersion: v1
kind: Config
clusters: [{{name: here, cluster: {{server: "http://127.0.0.1:{port}"}}}}]
contexts: [{{name: here, context: {{cluster: here, user: test}}}}]
users: [{{name: test, user: {{}}}}]
current-context: here
"""
# the plugin has pods install Snakemake's storage plugin, which this environment has
PIP = "#!/bin/sh\n"


@dataclass
class Pods:
    """Jobs that were asked for: the container that each describes, and the process that it became."""

    folder: Path
    containers: dict[str, Any] = field(default_factory=dict)
    processes: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    secrets: dict[str, dict[str, str]] = field(default_factory=dict)

    def start(self, name: str, container: dict[str, Any]) -> None:
        """Run a container's command in a folder of its own."""
        place = self.folder / name
        place.mkdir()
        self.containers[name] = container
        with (place / "pod.log").open("wb") as log:
            self.processes[name] = subprocess.Popen(
                [*container["command"], *container["args"]],
                cwd=place,
                env=self._environment(container),
                stdout=log,
                stderr=subprocess.STDOUT,
            )

    def status(self, name: str) -> dict[str, int]:
        """Return a job's status as Kubernetes words it."""
        code = self.processes[name].poll()
        return {"active": 1} if code is None else {"failed": 1} if code else {"succeeded": 1}

    def logs(self) -> str:
        """Return what all pods said."""
        return "\n".join(path.read_text(errors="replace") for path in sorted(self.folder.glob("*/pod.log")))

    def stop(self) -> None:
        """End what still runs."""
        for process in self.processes.values():
            process.kill()
            process.wait()

    def _environment(self, container: dict[str, Any]) -> dict[str, str]:
        first = (str(self.folder / "bin"), str(Path(sys.executable).parent))
        path = os.pathsep.join([*first, os.environ["PATH"]])
        secret = {
            variable["name"]: base64.b64decode(self.secrets[key["name"]][key["key"]]).decode()
            for variable in container.get("env") or []
            for key in [variable["valueFrom"]["secretKeyRef"]]
        }
        return {**os.environ, "PATH": path, **secret}


class Interface(BaseHTTPRequestHandler):
    """Answers for secrets, jobs and pods; jobs have no pods to look into, which the plugin accepts."""

    def __init__(self, *arguments: Any, pods: Pods) -> None:  # noqa: ANN401
        self.pods = pods
        super().__init__(*arguments)

    def do_POST(self) -> None:
        asked = self._asked()
        name = asked["metadata"]["name"]
        if self.path.endswith("/secrets"):
            self.pods.secrets[name] = asked.get("data") or {}
        else:
            self.pods.start(name, asked["spec"]["template"]["spec"]["containers"][0])
        self._answer(asked)

    def do_GET(self) -> None:
        if self.path.split("?")[0].endswith("/pods"):
            self._answer({"kind": "PodList", "apiVersion": "v1", "items": []})
            return
        name = self.path.split("/jobs/")[1].split("/")[0]
        job = {"kind": "Job", "apiVersion": "batch/v1", "metadata": {"name": name}}
        self._answer({**job, "status": self.pods.status(name)})

    def do_DELETE(self) -> None:
        self._asked()
        self._answer({"kind": "Status", "apiVersion": "v1", "status": "Success"})

    def log_message(self, *_: object) -> None:
        """Say nothing."""

    def _asked(self) -> Any:  # noqa: ANN401
        return json.loads(self.rfile.read(int(self.headers.get("Content-Length") or 0)) or b"{}")

    def _answer(self, content: dict[str, Any]) -> None:
        body = json.dumps(content).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


@contextlib.contextmanager
def cluster(folder: Path) -> Iterator[tuple[Pods, Path]]:
    """Serve the interface on the loopback; yield its pods, and the configuration that leads there."""
    pods = Pods(folder / "pods")
    program = pods.folder / "bin" / "pip"
    program.parent.mkdir(parents=True)
    program.write_text(PIP, encoding="utf-8")
    program.chmod(0o755)
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Interface, pods=pods))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    configuration = folder / "kubeconfig"
    configuration.write_text(CONFIGURATION.format(port=server.server_port), encoding="utf-8")
    try:
        yield pods, configuration
    finally:
        server.shutdown()
        server.server_close()
        pods.stop()
