#!/usr/bin/env python3
"""Runs every command of README.md and docs/. usage: commands_test.py RCSPLAT

Each ```sh block is run line by line, as it stands but for its size: a small scene stands in for the reader's, pictures
are small and few. Commands that are no rcsplat are run elsewhere or not at all; NOT_RUN says where and why.
"""
import json
import os
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PATIENCE = 600  # [s]

NOT_RUN = {
    "./quickstart": "what install tests begin with",
    "./tests/run": "runs this test",
    "docs/build": "docs.site",
    "tests/": "run by hand: they take other renderers, or the pictures of a long run",
    "python3 -m venv": "installs packages from elsewhere",
    "/tmp/venv/bin/python": "see above",
    "pip install": "see above",
    "sudo ": "changes the machine",
    "xdg-open": "opens a window",
    "man ": "waits for a reader",
    "rcsplat view ": "waits for a page: tests/service/view_visitors_test.py",
    "build/release/bin/rcsplat view ": "see above",
    "source <(": "tests/service/shell_test.py",
    "cmake ": "tests/install",
    "c++ ": "tests/install",
    "docker ": "docker/",
    "python3 librcs/examples/by_hand.py": "python.bindings",
    "service/blender/package.py": "service.blender; it takes protobuf from elsewhere",
}
# (command, pattern, what takes its place): the same in small.
SMALLER = [
    ("", r"--size \d+x\d+", "--size 32x24"),
    ("", r"--spp \d+", "--spp 16"),
    ("", r"--stride \d+", "--stride 2"),
    ("", r"--frames \d+-\d+(x\d+)?", "--frames 1-2"),
    ("", r"--budget \d+s", "--budget 2s"),
    ("", r"--target-error \d+%", "--target-error 50%"),
    ("", r"--engine slurm", "--engine slurm --no-submit"),  # there is no farm: tests/service/farm_test.py makes one
]
ADDED = {
    "render": "--aa 1 --size 32x24",
    "batch": "--aa 1 --size 32x24",
    "submit": "--aa 1 --size 32x24",
    "reference": "--size 32x24",
    "accuracy": "--size 32x24 --points 2 --path-samples 16 --reference-spp 64",
    "doctor": "--list",  # its cases are tests of their own
}


def corner_glb():
    """A floor and a wall under the sky, and a camera "atrium"."""
    points = [(0, 0, 0), (2, 0, 0), (2, 0, 2), (0, 0, 2), (0, 2, 0), (2, 2, 0)]
    triangles = [(0, 2, 1), (0, 3, 2), (0, 1, 5), (0, 5, 4)]
    data = b"".join(struct.pack("<3f", *p) for p in points) + b"".join(struct.pack("<3H", *t) for t in triangles)
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"mesh": 0}, {"camera": 0, "translation": [1, 1, 4]}],
        "cameras": [{"type": "perspective", "name": "atrium", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": 72}, {"buffer": 0, "byteOffset": 72, "byteLength": 24}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3", "min": [0, 0, 0],
                       "max": [2, 2, 2]}, {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def commands_of(page):
    for block in re.findall(r"^```sh\n(.*?)^```", page.read_text(), re.M | re.S):
        for line in block.replace("\\\n", " ").splitlines():
            command = re.sub(r"(^|\s)#.*", "", line).strip()
            if command:
                yield command


def in_small(command):
    words = command.split()
    for at in [i for i, word in enumerate(words) if word.split("/")[-1] == "rcsplat"]:
        name = words[at + 1] if at + 1 < len(words) else ""
        added = ADDED.get(name, "").split()
        kept = [pair for pair in zip(added[::2], added[1::2]) if pair[0] not in words[at:]]
        if name == "doctor":
            kept = [] if "--list" in words else [("--list",)]
        end = next((i for i in range(at, len(words)) if words[i] in ("&&", "|", ">")), len(words))
        words[end:end] = [word for pair in kept for word in pair]
    small = " ".join(words).replace("build/release/bin/rcsplat", "rcsplat")
    for _, pattern, instead in SMALLER:
        small = re.sub(pattern, instead, small)
    return small


def make_stand_ins(folder):
    for name in ["sponza.glb", "room.glb"]:
        (folder / name).write_bytes(corner_glb())
    (folder / "walk.json").write_text(json.dumps({"keys": [
        {"time": 0, "eye": [1, 1, 4], "target": [1, 1, 0]}, {"time": 1, "eye": [1.2, 1, 4], "target": [1, 1, 0]}]}))
    for name in ["frames", "found", "report"]:
        (folder / name).mkdir()


def run_page(page, program, folder):
    make_stand_ins(folder)
    environment = dict(os.environ, HOME=str(folder), XDG_RUNTIME_DIR=str(folder), XDG_STATE_HOME=str(folder / "state"),
                       PATH=f"{pathlib.Path(program).parent}:{os.environ['PATH']}")
    servers, failures, ran = [], [], 0
    try:
        for command in commands_of(page):
            if any(command.startswith(begin) for begin in NOT_RUN):
                continue
            if not re.search(r"(^|/|\s)rcsplat ", command + " "):
                failures.append(f"{page.name}: no test knows how to run: {command}")
                continue
            small = in_small(command)
            ran += 1
            if re.match(r"rcsplat serve(?!.*--check)", small):
                servers.append(subprocess.Popen(["bash", "-c", "exec " + small], cwd=folder, env=environment,
                                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
                end = time.monotonic() + PATIENCE
                socket = re.search(r"--socket (\S+)", small)
                asked = ["bash", "-c", "rcsplat list" + (f" --server {socket[1]}" if socket else "")]
                while subprocess.run(asked, env=environment, capture_output=True).returncode != 0:
                    if time.monotonic() > end or servers[-1].poll() is not None:
                        failures.append(f"{page.name}: the server does not answer: {small}")
                        break
                    time.sleep(0.1)
                continue
            done = subprocess.run(["bash", "-c", small], cwd=folder, env=environment, capture_output=True, text=True,
                                  stdin=subprocess.DEVNULL, timeout=PATIENCE)
            if done.returncode != 0:
                failures.append(f"{page.name}: {small}\n    ended with {done.returncode}: {done.stderr.strip()[-400:]}")
    finally:
        for server in servers:
            server.terminate()
            server.wait()
    return ran, failures


def main():
    program, ran, failures = str(pathlib.Path(sys.argv[1]).resolve()), 0, []
    for page in PAGES:
        with tempfile.TemporaryDirectory() as folder:
            count, wrong = run_page(page, program, pathlib.Path(folder))
        ran, failures = ran + count, failures + wrong
    print(f"{ran} commands ran")
    for failure in failures:
        print(failure)
    return 1 if failures or ran == 0 else 0


sys.exit(main())
