"""What is made beside an answer does not wait for threads that a forked process does not have."""

import os
import subprocess
import sys
from typing import Final

SCRIPT: Final = """
import numpy as np
from swesbi.base.processes import forked_processes

def work():
    ones = np.ones((1000, 1000), np.float32)
    return float((ones @ ones).max())

work()
with forked_processes(1) as worker:
    print(worker.submit(work).result())
"""
TIMEOUT_S: Final = 120


def test_a_worker_process_ends_after_its_parent_used_threads() -> None:
    surroundings = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    command = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 1000.0
