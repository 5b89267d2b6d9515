"""`rcsplat serve --engine slurm` on a cluster of two nodes that is started for it.

slurm_workers_test.py RCSPLAT; exit code 77 where Slurm, or the right to start it, is missing.
"""

import contextlib
import filecmp
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

from farm_test import SKIPPED, cluster, expect, run, wait_until

SMALL = ["demo:cornell", "--size", "48x40", "--aa", "1"]
LONG = ["demo:cornell", "--size", "1000x1000", "--aa", "256", "--rays", "4096", "-o", "long.png"]
OPTIONS = ["--engine", "slurm", "--workers", "2", "--worker-start", "60", "--worker-idle", "2", "--stop-grace", "0.5"]


class Server:
    """A server whose state all nodes see, as they are this machine."""

    def __init__(self, rcsplat, folder, *options):
        folder.mkdir()
        self.rcsplat, self.folder, self.options = rcsplat, folder, options
        self.socket, self.log = folder / "run/socket", folder / "log"
        self.start()

    def start(self):
        words = [self.rcsplat, "serve", "--socket", self.socket, "--state", self.folder / "state", *OPTIONS]
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen([*words, *self.options], stderr=log)
        wait_until(self.answers, "the server answers")

    def answers(self):
        expect(self.process.poll() is None, "the server has ended: " + self.log.read_text())
        return subprocess.run([self.rcsplat, "stats", "--server", self.socket], capture_output=True).returncode == 0

    def end(self, how):
        self.process.send_signal(how)
        return self.process.wait(60)

    def ask(self, command, *words):
        return run(self.rcsplat, command, *words, "--server", self.socket)

    def submit(self, *words):
        return self.ask("submit", *words, "--detach").split()[1]

    def status(self, number):
        return json.loads(self.ask("list", number, "--json"))["status"]

    def health(self):
        asked = subprocess.run([self.rcsplat, "stats", "--health", "--server", self.socket], capture_output=True,
                               text=True)
        return asked.stdout + asked.stderr

    def wait_for(self, number, state):
        wait_until(lambda: self.status(number)["state"] == state, f"job {number} is {state}")

    def wait_until_rendering(self, number):
        wait_until(lambda: any(running.get("fraction", 0) > 0.1 for running in self.status(number)["running"]),
                   f"job {number} is rendered")

    def workers(self):
        """Their processes, on whichever node."""
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                words = (entry / "cmdline").read_bytes().split(b"\0")
                if words[:2] == [str(self.rcsplat).encode(), b"worker"]:
                    found.append(int(entry.name))
        expect(found, "there is a worker")
        return found


def steps():
    return [line for line in run("squeue", "-h", "-o", "%j %T").splitlines() if "COMPLETING" not in line]


def test_pictures(server, rcsplat, folder):
    """Those of this machine, by two nodes; nobody's places are kept afterwards."""
    expect(steps() == [], "no node is taken before there is work")
    run(rcsplat, "render", *SMALL, "-q", "-o", folder / "local.exr")
    server.ask("submit", *SMALL, "--frames", "1-12", "-o", folder / "f.##.exr")
    for frame in range(1, 13):
        made = folder / f"f.{frame:02}.exr"
        expect(filecmp.cmp(made, folder / "local.exr", shallow=False), f"{made} is the picture of a local render")
    log = server.log.read_text()
    expect("host=n1" in log and "host=n2" in log, "both nodes worked: " + log)
    wait_until(lambda: steps() == [], "the nodes are free again")
    expect("event=worker_let_go" in server.log.read_text() and "worker_ended" not in server.log.read_text(),
           server.log.read_text())
    expect(server.health().startswith("serving: 0 workers"), "and the server is well: " + server.health())


def test_what_goes_wrong(server):
    number = server.submit(*LONG)
    server.wait_until_rendering(number)
    os.kill(server.workers()[0], signal.SIGKILL)
    wait_until(lambda: "was ended by signal 9" in server.log.read_text(), "the death of a worker is told")
    server.wait_until_rendering(number)
    logs = server.ask("logs", number)
    expect(logs.count("started, worker ") == 2 and " on n" in logs, "it was begun twice: " + logs)
    os.kill(server.workers()[0], signal.SIGSTOP)  # it hears nothing
    server.ask("cancel", number)
    server.wait_for(number, "JOB_STATE_CANCELLED")
    wait_until(lambda: steps() == [], "a worker that hangs is ended, and its node is free")

    number = server.submit(*LONG, "--time-limit", "2")
    server.wait_for(number, "JOB_STATE_FAILED")
    expect("took longer than the limit of 2 s" in server.status(number)["error"]["message"], server.status(number))
    number = server.submit("demo:cornell", "--size", "8000x8000", "-o", "a.png")
    server.wait_for(number, "JOB_STATE_FAILED")
    expect("more than the limit of 700 MB" in server.status(number)["error"]["message"], server.status(number))


def test_restarts(server):
    number = server.submit(*LONG)
    for how, code in ((signal.SIGTERM, 0), (signal.SIGKILL, -signal.SIGKILL)):
        server.wait_until_rendering(number)
        expect(server.end(how) == code, f"the server ended otherwise after {how}")
        wait_until(lambda: steps() == [], f"the nodes are free after {how}")
        server.start()
    server.wait_until_rendering(number)
    server.ask("cancel", number)
    server.wait_for(number, "JOB_STATE_CANCELLED")


def test_a_full_cluster(server, folder):
    """A worker for which Slurm has no room is no worker that hangs."""
    others = [subprocess.Popen(["srun", "-n1", "-Q", "sleep", "1000"]) for _ in range(2)]
    try:
        wait_until(lambda: steps() == ["sleep RUNNING"] * 2, "others have both nodes")
        number = server.submit(*SMALL, "-o", "a.png")
        wait_until(lambda: "rcsplat-worker PENDING" in steps(), "a worker waits")
        expect("not serving: frames wait until Slurm has room for a worker" in server.health(), server.health())
        server.ask("cancel", number)
        wait_until(lambda: "rcsplat-worker PENDING" not in steps(), "nobody waits for nothing")
        number = server.submit(*SMALL, "-o", "a.png")
        wait_until(lambda: "rcsplat-worker PENDING" in steps(), "a worker waits again")
    finally:
        for other in others:
            other.terminate()
            other.wait()
    server.wait_for(number, "JOB_STATE_COMPLETED")


def test_refusals(rcsplat, folder):
    server = Server(rcsplat, folder / "refused", "--srun-options", "--ntasks=3 --partition=nowhere")
    number = server.submit(*SMALL, "-o", "a.png")
    wait_until(lambda: "workers do not start" in server.health(), "a partition that is none is told")
    expect("nowhere" in server.log.read_text() or "partition" in server.log.read_text(), server.log.read_text())
    server.ask("cancel", number)
    expect(server.end(signal.SIGTERM) == 0, "it stops")


def main():
    rcsplat = os.path.abspath(sys.argv[1])
    missing = [name for name in ("slurmctld", "slurmd", "srun", "munged") if shutil.which(name) is None]
    if missing or os.geteuid() != 0:
        print("skipped: there is no", ", ".join(missing) or "right to start a cluster")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="rcs-slurm-") as name:
        folder = pathlib.Path(name).resolve()
        folder.chmod(0o755)
        (folder / "slurm").mkdir()
        with cluster(folder / "slurm"):
            more = ["--memory-limit", "700", "--srun-options", "--ntasks=2 --comment=of-workers"]
            server = Server(rcsplat, folder / "serve", *more)
            try:
                test_pictures(server, rcsplat, folder)
                test_what_goes_wrong(server)
                test_restarts(server)
                test_a_full_cluster(server, folder)
            finally:
                server.end(signal.SIGTERM)
            test_refusals(rcsplat, folder)
    print("all expectations hold")
    return 0


if __name__ == "__main__":
    sys.exit(main())
