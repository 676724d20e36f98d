"""What is made beside an answer does not wait for threads that a forked process does not have."""

import os
import subprocess
import sys
from typing import Final

SCRIPT: Final = """
import torch
from swesbi.study.stages.new_subject import worker_process

def work():
    return float(torch.zeros(2000, 2000).exp().sum())

torch.set_num_threads(2)
work()
with worker_process() as worker:
    print(worker.submit(work).result())
"""
TIMEOUT_S: Final = 120


def test_a_worker_process_ends_after_its_parent_used_threads() -> None:
    surroundings = {name: value for name, value in os.environ.items() if name != "OMP_NUM_THREADS"}
    command = [sys.executable, "-c", SCRIPT]
    done = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=TIMEOUT_S)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 4_000_000.0
