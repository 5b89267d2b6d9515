"""The systemd unit as it is installed: its command runs with its configuration and renders.

unit_test.py CMAKE BUILD: installs to a folder of its own, does as systemd would. Exit code 77: skipped.
"""

import fcntl
import grp
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time


def setting(unit, name):
    return re.findall(rf"^{name}=(.*)$", unit, re.MULTILINE)


def group_that_exists(config):
    """The configuration names the group that the sysusers file makes; here one that is there has to do."""
    try:
        grp.getgrnam("rcsplat")
    except KeyError:
        config.write_text(config.read_text().replace('"rcsplat"', f'"{grp.getgrgid(os.getgid()).gr_name}"'))


def check_files(prefix, unit):
    assert setting(unit, "User") == setting(unit, "Group") == ["rcsplat"]
    assert re.search(r"^u rcsplat ", (prefix / "lib/sysusers.d/rcsplat.conf").read_text(), re.MULTILINE)
    assert "/var/lib/rcsplat" in (prefix / "lib/tmpfiles.d/rcsplat.conf").read_text()
    for hardening in ("NoNewPrivileges=yes", "ProtectSystem=strict", "RestrictAddressFamilies=", "SystemCallFilter="):
        assert hardening in unit, hardening


def run_command(command, work):
    """Runs what the unit says, where systemd would have made its folders, and renders by it."""
    runtime, state = work / "run", work / "state"
    runtime.mkdir(mode=0o710)
    state.mkdir(mode=0o700)
    environment = {"PATH": os.defpath, "RUNTIME_DIRECTORY": str(runtime), "STATE_DIRECTORY": str(state)}
    server = subprocess.Popen(command, env=environment, umask=0o077)
    try:
        client = [command[0], "render", "demo:cornell", "--size", "16x16", "--aa", "1", "--rays", "16", "-q"]
        client += ["--server", str(runtime / "socket"), "-o", str(work / "a.png")]
        until = time.monotonic() + 120
        while not (runtime / "socket").exists():
            assert server.poll() is None, "the unit's command ended"
            assert time.monotonic() < until, "the unit's command does not listen"
            time.sleep(0.05)
        subprocess.run(client, check=True, timeout=300)
        assert (work / "a.png").stat().st_size > 100
        assert (state / "queue.db").exists()
    finally:
        server.send_signal(signal.SIGTERM)
        assert server.wait(60) == 0


def run_night(prefix, work):
    """Runs a batch as the nightly unit says; while it does, another one is told to come again."""
    units = prefix / "lib/systemd/system"
    unit = (units / "rcsplat-nightly@.service").read_text()
    assert "OnCalendar=" in (units / "rcsplat-nightly@.timer").read_text()
    command = shlex.split(setting(unit, "ExecStart")[0].replace("%i", "film"))
    description = pathlib.Path(command[command.index("--config") + 1])
    description.parent.mkdir(parents=True)
    description.write_text(f'scene = "demo:furnace"\nframes = "1-3"\nsize = "16x16"\naa = 1\n'
                           f'output = ["{work}/f.##.png", "{work}/f.##.exr"]\nindependent-frames = true\n')
    with open(description) as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        assert subprocess.run(command, timeout=300).returncode == 75, "a night that has not ended"
    assert not (work / "f.01.png").exists()
    assert subprocess.run(command, timeout=300).returncode == 0
    assert (work / "f.03.png").exists() and (work / "f.03.exr").exists() and (work / "report.html").exists()
    assert "demo:furnace" in (work / "report.json").read_text()
    description.write_text(description.read_text() + "scenes = 1\n")
    refused = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert refused.returncode == 2 and "--scenes" in refused.stderr, refused.stderr


def main():
    cmake, build = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        prefix = work / "prefix"
        subprocess.run([cmake, "--install", build, "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
        path = prefix / "lib/systemd/system/rcsplat.service"
        unit = path.read_text()
        assert "@BIN@" not in unit and "@CONFIG@" not in unit
        check_files(prefix, unit)
        command = shlex.split(setting(unit, "ExecStart")[0])
        assert command[0] == str(prefix / "bin/rcsplat")
        config = pathlib.Path(command[command.index("--config") + 1])
        config.write_text(config.read_text() + "# mine\n")
        subprocess.run([cmake, "--install", build, "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
        assert config.read_text().endswith("# mine\n"), "an installation keeps the configuration that is there"
        group_that_exists(config)
        run_command(command, work)
        run_night(prefix, work)
        if shutil.which("systemd-analyze") is None:
            print("skipped: systemd-analyze verify (there is no systemd-analyze)")
            return
        verified = subprocess.run(["systemd-analyze", "verify", "--recursive-errors=no", path], capture_output=True,
                                  text=True)
        assert verified.returncode == 0, verified.stderr
        said = [line for line in verified.stderr.splitlines() if "rcsplat.service" in line]
        assert not said, said


if __name__ == "__main__":
    main()
