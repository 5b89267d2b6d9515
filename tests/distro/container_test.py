#!/usr/bin/env python3
"""The service in its container (docker/Dockerfile): nobody in particular, nothing to write to but its volumes, healthy,
and a picture through its socket that is the host's, byte for byte. Skipped where no engine or no image of this tree is.

    container_test.py RCSPLAT [IMAGE]    # after: docker build -t librcs/rcsplat -f docker/Dockerfile .
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

SKIPPED = 77
SECONDS = 300  # for what a busy machine may take
TREE = pathlib.Path(__file__).resolve().parents[2]
BUILD = "docker build -t %s -f docker/Dockerfile ."
USER = os.getuid() or 7741  # root tries what others are
RENDER = ["demo:cornell", "--size", "48x48", "--aa", "1"]


def skip(why):
    print("skipped:", why)
    sys.exit(SKIPPED)


def run(*words, **settings):
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=SECONDS, **settings)
    if done.returncode != 0:
        sys.exit("failed (%d): %s\n%s%s" % (done.returncode, " ".join(map(str, words)), done.stdout, done.stderr))
    return done.stdout


def as_user(*words):
    """Clients of the socket are its user."""
    return run(*words, user=USER, group=USER) if os.getuid() == 0 else run(*words)


def skip_where_nothing_runs(engine, image):
    """A machine may have an engine that is allowed to run nothing."""
    tried = subprocess.run([engine, "run", "--rm", image, "--version"], capture_output=True, text=True, timeout=SECONDS)
    if tried.returncode in (125, 126):  # the engine's own failures
        skip("%s runs nothing here: %s" % (engine, tried.stderr.strip()[-300:]))


def sources_of(engine, image):
    """What docker/sources said where the image was made; nothing of an image that does not say."""
    name = "rcsplat-sources-%d" % os.getpid()
    run(engine, "create", "--name", name, image)
    try:
        with tempfile.TemporaryDirectory() as folder:
            copied = pathlib.Path(folder) / "sources"
            done = subprocess.run([engine, "cp", name + ":/usr/share/rcsplat/sources", copied], capture_output=True)
            return copied.read_text().strip() if done.returncode == 0 else ""
    finally:
        subprocess.run([engine, "rm", "-f", name], capture_output=True)


def skip_where_it_is_another_trees(engine, image):
    """An image that was left behind by earlier sources renders as those did."""
    if sources_of(engine, image) != run(TREE / "docker/sources").strip():
        skip("the image %s was made from other sources: %s" % (image, BUILD % image))


def wait_until_healthy(engine, name):
    until = time.monotonic() + SECONDS
    while subprocess.run([engine, "exec", name, "rcsplat", "stats"], capture_output=True).returncode != 0:
        if time.monotonic() > until:
            sys.exit("the service is not healthy:\n" + subprocess.run([engine, "logs", name], capture_output=True,
                                                                      text=True).stderr)
        time.sleep(0.2)


def try_service(engine, image, rcsplat, folder):
    volumes = []
    for part, inside in (("socket", "/run/rcsplat"), ("state", "/state"), ("scenes", "/scenes"), ("out", "/out")):
        (folder / part).mkdir(mode=0o700)
        os.chown(folder / part, USER, USER)
        volumes += ["-v", "%s:%s" % (folder / part, inside)]
    closed = ["--read-only", "--cap-drop", "all", "--security-opt", "no-new-privileges", "--network", "none",
              "--user", "%d:%d" % (USER, USER), *volumes]
    run(engine, "run", "--rm", *closed, image, "render", *RENDER, "-o", "/out/once.exr")
    name = "rcsplat-test-%d" % os.getpid()
    run(engine, "run", "-d", "--name", name, *closed, image)
    try:
        wait_until_healthy(engine, name)
        as_user(rcsplat, "submit", *RENDER, "--server", folder / "socket/socket", "-o", folder / "out/served.exr")
        as_user(rcsplat, "render", *RENDER, "-o", folder / "out/host.exr")
        run(engine, "stop", "-t", "60", name)
        code = run(engine, "inspect", "-f", "{{.State.ExitCode}}", name).strip()
        if code != "0":
            sys.exit("the service ended with %s when it was told to stop" % code)
    finally:
        subprocess.run([engine, "rm", "-f", name], capture_output=True)
    for made in ("once", "served"):
        picture = folder / "out" / (made + ".exr")
        if picture.stat().st_uid != USER:
            sys.exit(made + ".exr belongs to somebody else")
        if picture.read_bytes() != (folder / "out/host.exr").read_bytes():
            said = run(rcsplat, "compare", picture, folder / "out/host.exr")
            sys.exit("%s.exr is another picture:\n%s" % (made, said))


def main():
    rcsplat = pathlib.Path(sys.argv[1])
    image = sys.argv[2] if len(sys.argv) > 2 else "librcs/rcsplat"
    engines = list(filter(None, map(shutil.which, ("docker", "podman"))))
    if not engines:
        skip("there is no docker and no podman")
    having = [engine for engine in engines
              if subprocess.run([engine, "image", "inspect", image], capture_output=True).returncode == 0]
    if not having:
        skip("there is no image %s: %s" % (image, BUILD % image))
    skip_where_nothing_runs(having[0], image)
    skip_where_it_is_another_trees(having[0], image)
    folder = pathlib.Path(tempfile.mkdtemp())
    os.chmod(folder, 0o755)
    try:
        try_service(having[0], image, rcsplat, folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
