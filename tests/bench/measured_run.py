# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a program and measures its time and memory."""
import contextlib
import dataclasses
import os
import signal
import subprocess
import tempfile
import threading
import time


@dataclasses.dataclass
class Run:
    code: int  # exit code; negative: minus the signal that ended it
    timed_out: bool
    out: str
    err: str
    seconds: float  # wall clock
    cpu_seconds: float  # user and system, children of the program included
    peak_bytes: int  # resident, the largest single process among the program and its children


def measured_run(command, timeout=None):
    """Starts `command`, waits for it, and ends it with all its children after `timeout` seconds."""
    # Files instead of pipes, which would have to be read during the measurement.
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        expired = threading.Event()
        begin = time.monotonic()
        child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, start_new_session=True)

        def stop():
            expired.set()
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGKILL)

        timer = threading.Timer(timeout, stop) if timeout else None
        if timer:
            timer.start()
        # Not child.wait(), as only wait4 returns the usage of this child alone.
        _, status, usage = os.wait4(child.pid, 0)
        seconds = time.monotonic() - begin
        if timer:
            timer.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read().decode(errors="replace"))
        return Run(child.returncode, expired.is_set(), *texts, seconds, usage.ru_utime + usage.ru_stime,
                   usage.ru_maxrss * 1024)
