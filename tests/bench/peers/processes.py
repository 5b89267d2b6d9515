"""Runs a renderer as one process and measures it: the same for all, loading and writing included."""

import dataclasses
import os
import pathlib
import subprocess
import sys
import time


@dataclasses.dataclass
class Cost:
    wall: float  # [s]
    cpu: float  # user + system, of the process and all its children [s]


def timed(command, stdin=None, stdout=None, log=None, cwd=None, env=None):
    """Runs `command` to its end and returns its Cost; a failure ends this program with what it printed.
    stdin, stdout and log are paths."""
    log = pathlib.Path(log or os.devnull)
    with (open(stdin or os.devnull, "rb") as source, open(stdout or os.devnull, "wb") as sink,
          open(log, "w+b") as errors):
        begin = time.monotonic()
        process = subprocess.Popen([str(word) for word in command], stdin=source, stdout=sink, stderr=errors,
                                   cwd=cwd, env=env)
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.monotonic() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            errors.seek(0)
            sys.exit(f"{' '.join(map(str, command))}\nfailed with {process.returncode}: "
                     f"{errors.read().decode(errors='replace')[-2000:].strip()}")
    return Cost(wall, usage.ru_utime + usage.ru_stime)
