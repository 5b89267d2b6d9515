#!/usr/bin/env python3
"""rcsplat batch --engine slurm and openjd: all frames are there, and are those of one process.

usage: farm_test.py RCSPLAT slurm|openjd

Slurm is started here as a cluster of its own with two nodes, which takes root; its packages are slurmctld, slurmd,
slurm-client and munge. Open Job Description is what `openjd` on the path does, or that of OPENJD. Of 48 frames in 6
parts one task is killed and one taken off its node. Exits with 77 where these are missing.
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
import time

SKIPPED = 77
PATIENCE = 300
FRAMES = [f"f.{number:04d}.exr" for number in range(1, 49)]
CONFIGURATION = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/run/munge.sock,cred_expire=5
CredType=cred/munge
SlurmctldPort=16817
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/run/slurmctld.pid
SlurmdPidFile={folder}/run/slurmd.%n.pid
SlurmctldLogFile={folder}/log/slurmctld.log
SlurmdLogFile={folder}/log/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port=16818 CPUs=1 RealMemory=500 State=UNKNOWN
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port=16819 CPUs=1 RealMemory=500 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def expect(holds, what):
    if not holds:
        raise SystemExit(f"FAILED: {what}")


def wait_until(holds, what):
    end = time.monotonic() + PATIENCE
    while not holds():
        expect(time.monotonic() < end, f"in {PATIENCE} s: {what}")
        time.sleep(0.02)


def run(*words, **settings):
    done = subprocess.run(words, capture_output=True, text=True, check=False, **settings)
    expect(done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def renderer_of(word, folder):
    """The process of rcsplat that does a task of a batch into this folder."""
    for entry in pathlib.Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            words = (entry / "cmdline").read_bytes().split(b"\0")
            if words[0].endswith(b"rcsplat") and word.encode() in words and f"{folder}/f.####.exr".encode() in words:
                return int(entry.name)
    return None


def kill_renderer(word, folder, frame):
    """Once a frame of it is there."""
    wait_until((folder / frame).exists, f"{frame} of task {word}")
    pid = renderer_of(word, folder)
    expect(pid is not None, f"a process renders task {word}")
    os.kill(pid, signal.SIGKILL)


def batch(rcsplat, folder, *more):
    return [rcsplat, "batch", "demo:atrium", "--camera", "walk", "--frames", "1-48", "--size", "64x48", "--aa", "1",
            "--rays", "32", "--threads", "1", "-o", f"{folder}/f.####.exr", *more]


def check_frames(folder, local=None):
    report = json.loads((folder / "report.json").read_text())
    expect(report["counts"] == {"frames": 48, "rendered": 0, "kept": 48, "failed": 0, "left": 0}, report["counts"])
    expect((folder / "report.html").exists(), "the page of the report")
    expect(sorted(file.name for file in folder.glob("f.*")) == FRAMES, "no frame is missing, and no other file there")
    expect(len(list((folder / ".rcsplat").iterdir())) == 48, "nothing is left half done")
    for frame in FRAMES if local else []:
        expect(filecmp.cmp(folder / frame, local / frame, shallow=False), f"{frame} is that of one process")
    return report


@contextlib.contextmanager
def cluster(folder):
    for name in ("state", "spool.n1", "spool.n2", "log", "run"):
        (folder / name).mkdir()
    folder.chmod(0o755)
    host = os.uname().nodename.split(".")[0]
    (folder / "slurm.conf").write_text(CONFIGURATION.format(folder=folder, host=host))
    (folder / "munge.key").write_bytes(os.urandom(1024))
    for name in ("run", "munge.key"):
        shutil.chown(folder / name, "munge", "munge")
    (folder / "munge.key").chmod(0o400)
    os.environ["SLURM_CONF"] = f"{folder}/slurm.conf"
    daemons = []

    def start(*words, **settings):
        with open(folder / "daemons.log", "ab") as log:
            daemons.append(subprocess.Popen(words, stdout=log, stderr=log, **settings))

    try:
        start("munged", "-F", "-f", f"--key-file={folder}/munge.key", f"--socket={folder}/run/munge.sock",
              f"--pid-file={folder}/run/munged.pid", f"--log-file={folder}/run/munged.log",
              f"--seed-file={folder}/run/munge.seed", user="munge", group="munge", extra_groups=[])
        wait_until((folder / "run/munge.sock").exists, "munged")
        start("slurmctld", "-D", "-i")
        start("slurmd", "-D", "-N", "n1")
        start("slurmd", "-D", "-N", "n2")
        wait_until(lambda: subprocess.run(["sinfo", "-h", "-o", "%D %t"], capture_output=True, text=True,
                                          check=False).stdout == "2 idle\n", "two idle nodes")
        yield
    finally:
        for daemon in reversed(daemons):
            daemon.terminate()
            daemon.wait()


def wait_for_job(job, state="COMPLETED"):
    wait_until(lambda: f"JobState={state}" in run("scontrol", "show", "job", "-o", job), f"job {job} is {state}")


def test_slurm(rcsplat, work, local):
    # Alone: the bits of one process, though a task is killed and another one taken off its node.
    folder = work / "alone"
    submitted = run(*batch(rcsplat, folder, "--engine", "slurm", "--chunk", "8", "--independent-frames")).split()
    array, report = (submitted[submitted.index(word) + 1] for word in ("frames", "report"))
    kill_renderer("2/6", folder, "f.0011.exr")
    wait_until((folder / "f.0019.exr").exists, "a frame of part 3")
    run("scontrol", "requeue", f"{array}_3")
    wait_for_job(report)
    check_frames(folder, local)
    expect("Restarts=1" in run("scontrol", "show", "job", "-o", f"{array}_3"), "part 3 was begun again")
    log = (folder / "job/logs/part-2.log").read_text()
    expect("Killed" in log and log.count("frame 9: rendered") == 1, "part 2 went on where it was killed")
    expect("frame 17: done before" in (folder / "job/logs/part-3.log").read_text(), "part 3 as well")

    # Together: parts begin with the overture's frames, records and exposure.
    folder = work / "together"
    submitted = run(*batch(rcsplat, folder, "--engine", "slurm", "--chunk", "8")).split()
    array, report = (submitted[submitted.index(word) + 1] for word in ("frames", "report"))
    wait_until((folder / "f.0019.exr").exists, "a frame of part 3")
    run("scancel", f"{array}_3")
    wait_for_job(report, "FAILED")
    frames = json.loads((folder / "report.json").read_text())["frames"]
    missing = {f["frame"] for f in frames if f["state"] != "done before"}
    expect(missing and missing <= set(range(20, 25)), f"the report tells what was cancelled: {missing}")
    submitted = run(*batch(rcsplat, folder, "--engine", "slurm", "--chunk", "8")).split()
    wait_for_job(submitted[submitted.index("report") + 1])
    report = check_frames(folder)
    expect(len({f["figures"]["exposure"] for f in report["frames"]}) == 1, "one exposure for all")
    expect((folder / "job/shot.records").exists(), "records of the shot")


def test_openjd(rcsplat, work, local):
    openjd = os.environ.get("OPENJD", "openjd")
    folder = work / "alone"
    run(*batch(rcsplat, folder, "--engine", "openjd", "--chunk", "8", "--independent-frames"))
    template = folder / "job/template.yaml"
    run(openjd, "check", template)
    session = subprocess.Popen([openjd, "run", template], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    kill_renderer("2/6", folder, "f.0011.exr")
    wait_until((folder / "f.0019.exr").exists, "a frame of part 3")
    session.send_signal(signal.SIGINT)
    session.wait()
    wait_until(lambda: renderer_of("3/6", folder) is None, "the renderer ends with the session")
    expect(not (folder / "report.json").exists(), "there is no report of a session that was cancelled")
    first = (folder / "f.0017.exr").stat().st_mtime_ns
    run(openjd, "run", template)
    check_frames(folder, local)
    expect((folder / "f.0017.exr").stat().st_mtime_ns == first, "frames that are done are left as they are")

    folder = work / "together"
    run(*batch(rcsplat, folder, "--engine", "openjd", "--chunk", "8"))
    run(openjd, "run", folder / "job/template.yaml")
    report = check_frames(folder)
    expect(len({f["figures"]["exposure"] for f in report["frames"]}) == 1, "one exposure for all")


def main():
    rcsplat, engine = os.path.abspath(sys.argv[1]), sys.argv[2]
    needed = {"slurm": ["slurmctld", "slurmd", "sbatch", "munged"], "openjd": [os.environ.get("OPENJD", "openjd")]}
    missing = [name for name in needed[engine] if shutil.which(name) is None]
    if missing or (engine == "slurm" and os.geteuid() != 0):
        print("skipped: there is no", ", ".join(missing) or "right to start a cluster")
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="rcs-farm-") as folder:
        work = pathlib.Path(folder).resolve()
        (work / "local").mkdir()
        run(*batch(rcsplat, work / "local", "--independent-frames", "-q"))
        if engine == "openjd":
            test_openjd(rcsplat, work, work / "local")
        else:
            (work / "slurm").mkdir()
            work.chmod(0o755)
            with cluster(work / "slurm"):
                test_slurm(rcsplat, work, work / "local")
    print("all expectations hold")
    return 0


if __name__ == "__main__":
    sys.exit(main())
