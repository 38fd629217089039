#!/usr/bin/env python3
"""The batch script for clusters, started by mpirun: killed, resumed, and the same bytes as without a break.

    cluster.py <program for MPI> <source tree> [points along each of two gains]
"""

import contextlib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
from packages import skip  # noqa: E402

program, source = sys.argv[1], pathlib.Path(sys.argv[2])
count = sys.argv[3] if len(sys.argv) > 3 else "700"
if not shutil.which("mpirun"):
    skip("mpirun")
environment = {
    **os.environ,
    "LAUNCH": "mpirun --oversubscribe -n 2",
    "TILTRIM": program,
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
}


def start(study, map_file):
    command = ["bash", source / "examples/cluster/map.sbatch", study, map_file]
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL,
                            text=True, start_new_session=True)  # fmt: skip


with tempfile.TemporaryDirectory() as folder:
    text = (source / "studies/map_two_gains.toml").read_text()
    study = pathlib.Path(folder, "study.toml")
    study.write_text(re.sub(r"^count = \d+", f"count = {count}", text, flags=re.M))
    whole, broken = pathlib.Path(folder, "whole.nc"), pathlib.Path(folder, "broken.nc")
    begin = time.monotonic()
    once = start(study, whole)
    told = once.communicate()[1]
    assert once.returncode == 0 and whole.is_file(), told
    seconds = time.monotonic() - begin

    log = pathlib.Path(f"{broken}.log")
    killed = start(study, broken)
    while killed.poll() is None and not (log.is_file() and log.stat().st_size > 1000):
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    for command in pathlib.Path("/proc").glob("[0-9]*/cmdline"):  # ranks in sessions of their own
        with contextlib.suppress(OSError):
            if str(broken).encode() in command.read_bytes():
                os.kill(int(command.parent.name), signal.SIGKILL)
    killed.communicate()
    assert not broken.is_file(), "the map was finished before it was killed"
    for _ in range(60):  # ranks outlive the mpirun that was killed by a moment, and with them the lock
        again = start(study, broken)
        told = again.communicate()[1]
        if "another process" not in told:
            break
        time.sleep(0.5)
    assert again.returncode == 0, told
    assert f"resumed from {log}" in told, told
    assert broken.read_bytes() == whole.read_bytes(), "other bytes after a break"
    assert not log.exists()
    print(f"{count} x {count} points by 2 ranks: {seconds:.1f} s, {whole.stat().st_size / 1e6:.0f} MB")
