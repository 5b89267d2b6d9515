"""The server that Blender renders with: one that answers, or one that is started here and stopped with Blender."""

from __future__ import annotations

import os
import pathlib
import shutil
import socket
import subprocess
import threading
import time
from typing import List, Optional

from rcsplat import ConnectionLost
from rcsplat.connection import default_address, own_address

START_SECONDS = 20.0


def is_path(address: str) -> bool:
    return "/" in address or ":" not in address


def answers(path: str) -> bool:
    with socket.socket(socket.AF_UNIX) as probe:
        try:
            probe.settimeout(2.0)
            probe.connect(path)
        except OSError:
            return False
    return True


def find_program(given: str) -> Optional[str]:
    """@param given  in the preferences; empty: $RCSPLAT, or in $PATH"""
    return shutil.which(given or os.environ.get("RCSPLAT") or "rcsplat")


class Server:
    """At most one process."""

    def __init__(self) -> None:
        self._process: "Optional[subprocess.Popen[bytes]]" = None
        self._lock = threading.Lock()

    def ensure(self, address: str, program: str, may_start: bool) -> str:
        """The address of a server that answers; one is started where this machine's own is meant and there is none."""
        address = address or default_address()
        if not is_path(address) or answers(address) or not may_start or address != (
                os.environ.get("RCSPLAT_SERVER") or own_address()):
            return address
        with self._lock:
            if not answers(address):
                self._start(address, find_program(program))
        return address

    def _start(self, address: str, program: Optional[str]) -> None:
        if program is None:
            raise ConnectionLost(f"no server answers on {address}, and no rcsplat is found to start one: "
                                 "name it in the add-on's preferences")
        words: List[str] = [program, "serve", "--socket", address]
        if os.environ.get("RCSPLAT_STATE"):
            words += ["--state", os.environ["RCSPLAT_STATE"]]
        pathlib.Path(address).parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._process = subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.PIPE, start_new_session=True)
        said = _LastLine(self._process)
        until = time.monotonic() + START_SECONDS
        while not answers(address):
            if self._process.poll() is not None or time.monotonic() > until:
                raise ConnectionLost(f"{program} serve did not start: {said.line or 'it says nothing'}")
            time.sleep(0.02)

    @property
    def started(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def stop(self) -> None:
        """One that was started here."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(10.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._process = None


class _LastLine:
    """Reads what a process says, so that it never waits for who reads it."""

    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        self.line = ""
        self._stream = process.stderr
        threading.Thread(target=self._read, name="rcsplat server", daemon=True).start()

    def _read(self) -> None:
        for line in self._stream or ():
            self.line = line.decode(errors="replace").strip()


SERVER = Server()
