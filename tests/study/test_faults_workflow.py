"""The workflow after faults: damaged shards, left-over locks, folders that cannot be written, orphans."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from study_arrays import arrays
from study_copy import StudyCopy

from swesbi.study.running import hold_with_others

SHARD = "results-smoke/simulations/paper/A/shard-0.h5"
POOL = "results-smoke/paper/pool.h5"

HOLDER = (
    "import sys, time; from pathlib import Path; from swesbi.study.running import hold_with_others\n"
    "hold_with_others(Path(sys.argv[1]), lambda: print('alone', flush=True))\n"
    "print('held', flush=True); time.sleep(60)\n"
)
ORPHAN = (
    "import sys, time; from swesbi.base.workers import exit_when_gone\n"
    "exit_when_gone(int(sys.argv[1])); print('watching', flush=True); time.sleep(60)\n"
)


def damaged_by(path: Path, way: str) -> None:
    """Damage a file and keep its modification time, as a failing disk does."""
    times, content = path.stat(), bytearray(path.read_bytes())
    if way == "bit flip":
        content[len(content) // 2] ^= 8
    else:
        del content[len(content) * 2 // 3 :]
    path.write_bytes(content)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


@pytest.mark.slow
@pytest.mark.parametrize("way", ["bit flip", "truncation"])
def test_a_damaged_shard_is_named_and_repaired_by_the_printed_command(own_study: StudyCopy, way: str) -> None:
    shard, pool = own_study.folder / SHARD, own_study.folder / POOL
    before = {path: arrays(path) for path in (shard, pool)}
    damaged_by(shard, way)
    pool.unlink()
    done = own_study.snakemake(POOL)
    assert done.returncode != 0
    assert not pool.exists()
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("DamagedArtefactError")]
    assert f"{SHARD}: " in line
    command = line.split("delete it and rerun: ")[1]
    assert command.endswith(f" --configfile {own_study.config}")
    checked = own_study.call("-m", "swesbi", "inspect", "--check", "results-smoke")
    assert checked.stderr.split("rerun: ")[1].strip() == command
    subprocess.run(command, shell=True, cwd=own_study.folder, env=own_study.environment, check=True)
    own_study.run(POOL)
    for path, expected in before.items():
        found = arrays(path)
        assert found.keys() == expected.keys()
        assert all((found[name] == expected[name]).all() for name in expected)


@pytest.mark.slow
def test_left_over_locks_and_markers_stop_nothing_and_a_dry_run_leaves_them(own_study: StudyCopy) -> None:
    state, result = own_study.folder / ".snakemake", "results-smoke/cohort/A/passive.h5"
    (state / "locks").mkdir(exist_ok=True)
    lock = state / "locks" / "0.output.lock"
    lock.write_text(f"{result}\n")
    (state / "incomplete" / "cmVzdWx0cy1zbW9rZS9jb2hvcnQvQS9wYXNzaXZlLmg1").write_text(
        '{"external_jobid": null}'
    )
    assert own_study.snakemake("--dry-run", result).returncode == 0
    assert lock.exists()
    done = own_study.snakemake(result)
    assert done.returncode == 0, done.stderr
    assert "The last run was killed" in done.stderr
    assert not lock.exists()


def mount(*options: str) -> None:
    """Mount a folder, or skip the test where that is not permitted."""
    command = ["mount", *options]
    if not shutil.which("mount") or subprocess.run(command, capture_output=True, check=False).returncode != 0:
        subprocess.run(["umount", options[-1]], capture_output=True, check=False)
        pytest.skip("mounting is not permitted here")


@pytest.fixture
def read_only(own_study: StudyCopy) -> Iterator[StudyCopy]:
    """A study whose results lie on a read-only file system."""
    target = str(own_study.results)
    mount("--bind", target, target)
    mount("-o", "remount,ro,bind", target)
    yield own_study
    subprocess.run(["umount", target], check=True)


@pytest.mark.slow
def test_a_read_only_results_folder_is_named_before_any_job(read_only: StudyCopy) -> None:
    done = read_only.snakemake("--forcerun", "passive")
    assert done.returncode != 0
    assert "results-smoke: results cannot be written, the folder is on a read-only file system" in done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert read_only.snakemake("--dry-run").returncode == 0


@pytest.fixture
def nearly_full(own_study: StudyCopy) -> Iterator[StudyCopy]:
    """A study whose pool is to be written on a disk of 64 KiB."""
    target = own_study.results / "paper"
    shutil.rmtree(target)
    target.mkdir()
    mount("-t", "tmpfs", "-o", "size=64k", "none", str(target))
    yield own_study
    subprocess.run(["umount", str(target)], check=True)


@pytest.mark.slow
def test_a_full_disk_is_named_and_leaves_nothing_half_written(nearly_full: StudyCopy) -> None:
    done = nearly_full.snakemake(POOL)
    assert done.returncode != 0
    assert f"{POOL}: cannot be written, the disk is full: free some space" in done.stderr
    assert list((nearly_full.results / "paper").iterdir()) == []


def test_only_a_lone_run_removes_locks_and_a_killed_one_is_no_company(tmp_path: Path) -> None:
    lock, calls = tmp_path / "state" / "lock", []
    os.close(hold_with_others(lock, lambda: calls.append("first")))
    holder = subprocess.Popen([sys.executable, "-c", HOLDER, str(lock)], stdout=subprocess.PIPE, text=True)
    try:
        assert holder.stdout is not None
        assert [holder.stdout.readline(), holder.stdout.readline()] == ["alone\n", "held\n"]
        os.close(hold_with_others(lock, lambda: calls.append("beside a living run")))
    finally:
        holder.kill()
        holder.wait()
    os.close(hold_with_others(lock, lambda: calls.append("after a killed run")))
    assert calls == ["first", "after a killed run"]


def test_a_job_ends_soon_after_its_run() -> None:
    run = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    job = subprocess.Popen([sys.executable, "-c", ORPHAN, str(run.pid)], stdout=subprocess.PIPE, text=True)
    try:
        assert job.stdout is not None
        assert job.stdout.readline() == "watching\n"
        time.sleep(0.5)
        assert job.poll() is None
        run.kill()
        run.wait()
        assert job.wait(5) == 3
    finally:
        for process in (run, job):
            process.kill()
            process.wait()
