"""Packs the Python client, installs it into a clean virtual environment and uses it against a real server.

python_client_test.py RCSPLAT SCENE; exit code 77 where the scene is missing or no package index can be reached.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLAIN = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
# Options of `rcsplat submit` that are others in Python, or are none: what they are for is said by other means there.
OTHERS = {"size": "width", "effects": "with_effects", "eye": "camera", "target": "camera", "up": "camera",
          "fov": "camera", "with": "with_effects", "without": "without_effects", "accuracy": "error_tolerance",
          "noise": "noise_target", "budget": "budget_seconds", "output": "outputs", "layers": "outputs",
          "pixel_format": "outputs", "key": "idempotency_key", "label": "labels"}
NONE = {"help": "", "help_all": "", "json": "", "quiet": "progress() is asked for", "log_level": "logging",
        "detach": "wait() is asked for", "server": "of Client", "token_file": "of Client",
        "tls_ca": "of Client", "tls_certificate": "of Client", "tls_key": "of Client", "camera_path": "frames"}
SCRIPT = """
import asyncio
import sys
import numpy
from PIL import Image
from rcsplat import AsyncClient, BadArgument, Client, NotFound, Output, RenderError, RequestRefused, View, job_pb2

address, scene, expected = sys.argv[1:4]
with Client(address) as client:
    while not client.health().serving:  # until a worker is ready
        pass
    job = client.submit(scene, width=40, height=32, bounces=2, error_tolerance=0.3, labels={"test": "python"})
    stages = [s.running[0].stage for s in job.progress() if s.running]
    assert stages, "no progress was seen"
    image = job.image()
    assert image.shape == (32, 40, 3) and image.dtype == numpy.uint8, image.shape
    same = numpy.array_equal(image, numpy.asarray(Image.open(expected).convert("RGB")))
    assert same, "not the picture of the command line"
    assert client.jobs()[0].labels["test"] == "python"
    again = client.submit(scene, width=40, height=32, bounces=2, error_tolerance=0.3)
    assert numpy.array_equal(again.image(), image)
    plain, shifted = (client.submit(scene, width=40, height=32, exposure=0.0, lens_shift=shift).image().astype(int)
                      for shift in ((0, 0), (0.25, 0)))
    moved, kept = (numpy.abs(shifted[:, :32] - plain[:, i:i + 32]).mean() for i in (8, 0))
    assert moved < 0.3 * kept, "not moved by 8 pixels: %g, %g" % (moved, kept)
    try:
        client.submit("demo:cornell", width=0)
        raise SystemExit("a width of 0 was taken")
    except BadArgument as error:
        assert error.code_name == "ERROR_CODE_BAD_ARGUMENT" and "width is 0" in str(error), error
    for wrong, words in (
        ({"error_tolerance": 0.3, "budget_seconds": 5},
         "quality is settings and budget_seconds, expected one of settings, target_error, budget_seconds, "
         "target_indirect_error"),
        ({"target_error": 0.1, "budget_seconds": 5}, "quality is target_error and budget_seconds, expected"),
        ({"records": {}}, "there is no option records"),
        ({"budget_seconds": 0}, "budget_seconds is 0, expected a value in (0, 1000000]"),
        ({"with_effects": ["magic"]}, "with_effects is magic, expected one of emission"),
        ({"splat": "dots"}, "splat is dots, expected one of auto, quads, tiles, gpu-tiles"),
    ):
        try:
            client.submit("demo:cornell", **wrong)
            raise SystemExit("%s was taken" % wrong)
        except RenderError as error:
            assert error.code_name == "ERROR_CODE_BAD_ARGUMENT" and words in str(error), error
    other = client.submit("demo:cornell", width=16, height=16, settings={"rays": 16}, min_reach=5)
    assert other.wait().frames_completed == 1
    failing = client.submit("demo:cornell", camera="nowhere", width=16, height=16)
    try:
        failing.wait()
        raise SystemExit("a missing camera was found")
    except NotFound as error:
        assert isinstance(error, (RequestRefused, RenderError)) and error.code == job_pb2.ERROR_CODE_NOT_FOUND, error
    seen = client.submit("demo:cornell", camera=View(eye=(0, 1, 3), target=(0.2, 0.8, 0), fov=45), width=32, height=32,
                         splat="tiles", environment=(0.5, 1.0, 2.0), time_limit=60.0, priority=3,
                         outputs=[Output("a.exr", layers=["normal"], pixel_format="float"), "image.png"])
    assert numpy.array_equal(seen.image(), numpy.asarray(Image.open(sys.argv[4]).convert("RGB"))), "--eye"
    assert seen.read("a.exr").startswith(b"\\x76\\x2f\\x31\\x01")

    async def many():
        async with AsyncClient(address) as client:
            jobs = [await client.submit("demo:cornell", width=16, height=16, seed=i) for i in range(3)]
            ends = await asyncio.gather(*(job.wait() for job in jobs))
            assert [end.frames_completed for end in ends] == [1, 1, 1]
            assert (await jobs[0].image()).shape == (16, 16, 3)
            try:
                await client.job(10**6).wait()
                raise SystemExit("a job that is none was found")
            except NotFound:
                pass
    asyncio.run(many())
    running = client.submit("demo:atrium", width=2000, height=2000, aa=64)
    running.cancel()
    waiting = client.submit("demo:cornell", width=300, height=300, settings={"rays": 2048})
    for status in waiting.progress():
        if status.running:
            print("restart me", flush=True)
            break
    sys.stdin.readline()
    assert waiting.wait().frames_completed == 1, "after a restart of the server"
print("python client: all held")
"""


def run(*words) -> subprocess.CompletedProcess:
    return subprocess.run([str(word) for word in words], capture_output=True, text=True)


def is_offline(outcome: subprocess.CompletedProcess) -> bool:
    said = outcome.stdout + outcome.stderr
    return "Could not find a version" in said or "No matching distribution" in said


def check_options(rcsplat: str, python: pathlib.Path) -> None:
    """Each option of the command line is one of submit()."""
    listed = re.findall(r"^ +(?:-\w, )?--([\w-]+)", run(rcsplat, "submit", "--help-all").stdout, re.M)
    names = run(python, "-c", "from rcsplat.job_options import option_names; print(*option_names())").stdout.split()
    words = {word.replace("-", "_") for word in listed} - NONE.keys()
    assert len(words) > 40, words
    missing = {word for word in words if OTHERS.get(word, word) not in names}
    assert not missing, f"submit() lacks {missing}"


def check_types(python: pathlib.Path) -> None:
    installed = run(python, "-m", "pip", "install", "--quiet", "--retries", "1", "mypy", "types-protobuf")
    if installed.returncode != 0:
        print("skipped: mypy cannot be had:", installed.stderr)
        return
    checked = run(python, "-m", "mypy", "--strict", "-p", "rcsplat")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def main() -> int:
    rcsplat, scene = sys.argv[1], sys.argv[2]
    if not pathlib.Path(scene).exists():
        print(f"skipped: needs {scene}")
        return 77
    with tempfile.TemporaryDirectory(prefix="rcs-python-") as name:
        folder = pathlib.Path(name)
        subprocess.run([sys.executable, "-m", "venv", folder / "venv"], check=True)
        python = folder / "venv/bin/python"
        # Built in a copy, so that nothing is left in the source.
        source = folder / "source"
        for part in ("service/python", "proto"):
            shutil.copytree(ROOT / part, source / part)
        pip = [python, "-m", "pip", "install", "--quiet", "--retries", "1", "--timeout", "10"]
        for step in ([*pip, "build"], [python, "-m", "build", "--outdir", folder / "dist", source / "service/python"],
                     [*pip, folder / "dist" / "rcsplat-0.1.0-py3-none-any.whl"]):
            outcome = run(*step)
            if outcome.returncode != 0:
                print(outcome.stdout, outcome.stderr)
                return 77 if is_offline(outcome) else 1
        assert (folder / "dist/rcsplat-0.1.0.tar.gz").exists()
        check_options(rcsplat, python)
        check_types(python)
        options = ["--size", "40x32", "--bounces", "2", "--accuracy", "0.3", "-q"]
        expected = folder / "expected.png"
        subprocess.run([rcsplat, "render", scene, *options, "-o", expected], check=True)
        given = folder / "given.png"
        subprocess.run([rcsplat, "render", "demo:cornell", "--size", "32x32", "--eye", "0,1,3", "--target", "0.2,0.8,0",
                        "--environment", "0.5,1,2", "--splat", "tiles", "-q", "-o", given], check=True)
        socket = folder / "run/socket"

        def start() -> subprocess.Popen:
            with open(folder / "log", "a") as log:
                return subprocess.Popen([rcsplat, "serve", "--socket", socket, "--state", folder / "state"], stderr=log)

        server = start()
        try:
            for _ in range(500):
                if socket.exists():
                    break
                time.sleep(0.02)
            example = [python, ROOT / "service/python/example.py", socket]
            subprocess.run(example, cwd=folder, check=True, stdout=subprocess.DEVNULL, env=PLAIN)
            assert (folder / "example.png").exists(), "the example runs from any folder, as installed"
            client = subprocess.Popen([python, "-c", SCRIPT, socket, scene, expected, given], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, text=True)
            if client.stdout.readline() == "restart me\n":
                server.kill()
                server.wait(30)
                server = start()
                client.stdin.write("\n")
            print(client.communicate(timeout=120)[0])
            return client.returncode
        finally:
            server.terminate()
            server.wait(30)


if __name__ == "__main__":
    sys.exit(main())
