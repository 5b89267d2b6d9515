"""Installs the Python client into a clean virtual environment and uses it against a real server.

python_client_test.py RCSPLAT SCENE; exit code 77 where the scene is missing or no package index can be reached.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PLAIN = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
SCRIPT = """
import sys
import numpy
from PIL import Image
from rcsplat import Client, RenderError, job_pb2

address, scene, expected = sys.argv[1:]
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
                      for shift in (None, (0.25, 0)))
    moved, kept = (numpy.abs(shifted[:, :32] - plain[:, i:i + 32]).mean() for i in (8, 0))
    assert moved < 0.3 * kept, "not moved by 8 pixels: %g, %g" % (moved, kept)
    try:
        client.submit("demo:cornell", width=0)
        raise SystemExit("a width of 0 was taken")
    except RenderError as error:
        assert error.code_name == "ERROR_CODE_BAD_ARGUMENT" and "width is 0" in str(error), error
    for wrong, words in (
        ({"error_tolerance": 0.3, "budget_seconds": 5},
         "quality is settings and budget_seconds, expected one of settings, target_error, budget_seconds"),
        ({"target_error": 0.1, "budget_seconds": 5}, "quality is target_error and budget_seconds, expected"),
        ({"records": {}}, "there is no option records"),
        ({"budget_seconds": 0}, "budget_seconds is 0, expected a value in (0, 1000000]"),
        ({"with_effects": ["magic"]}, "with_effects is magic, expected one of emission"),
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
    except RenderError as error:
        assert error.code == job_pb2.ERROR_CODE_NOT_FOUND, error
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
        installed = subprocess.run([python, "-m", "pip", "install", "--quiet", "--retries", "1", "--timeout", "10",
                                    source / "service/python"], capture_output=True, text=True)
        if installed.returncode != 0:
            print(installed.stderr)
            offline = "Could not find a version" in installed.stderr or "No matching distribution" in installed.stderr
            return 77 if offline else 1
        options = ["--size", "40x32", "--bounces", "2", "--accuracy", "0.3", "-q"]
        expected = folder / "expected.png"
        subprocess.run([rcsplat, "render", scene, *options, "-o", expected], check=True)
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
            client = subprocess.Popen([python, "-c", SCRIPT, socket, scene, expected], stdin=subprocess.PIPE,
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
