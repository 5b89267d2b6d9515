#!/usr/bin/env python3
"""Completions complete and manual pages are well-formed. usage: shell_test.py RCSPLAT

bash is asked what it completes; zsh, fish and groff check what is for them, where they are.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

RCSPLAT = sys.argv[1]


def said(*words):
    return subprocess.run([RCSPLAT, *words], check=True, capture_output=True, text=True).stdout


def completed(line, folder):
    """What bash offers at the end of a line."""
    script = (f"source {folder}/rcsplat.bash; COMP_LINE={line!r} COMP_POINT={len(line)}; _rcsplat; "
              'printf "%s\\n" "${COMPREPLY[@]}"')
    done = subprocess.run(["bash", "--norc", "-c", script], cwd=folder, check=True, capture_output=True, text=True)
    return set(done.stdout.split())


def expect(condition, what):
    if not condition:
        sys.exit(f"not so: {what}")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for shell in ["bash", "zsh", "fish"]:
            (folder / f"rcsplat.{shell}").write_text(said("completion", shell))
        (folder / "room.glb").touch()
        (folder / "frames").mkdir()
        for line, offered in {
                "rcsplat ref": {"reference"},
                "rcsplat render --si": {"--size"},
                "rcsplat render demo:cornell --splat ": {"auto", "quads", "tiles", "gpu-tiles"},
                "rcsplat render demo:at": {"atrium"},
                "rcsplat render roo": {"room.glb"},
                "rcsplat render demo:cornell -o fra": {"frames"},
                "rcsplat completion z": {"zsh"},
                "rcsplat serve --work": {"--workers", "--worker-start", "--worker-idle"},
                "rcsplat plan --expo": set(),
        }.items():
            expect(completed(line, folder) == offered, f"{line!r} offers {completed(line, folder)}, expected {offered}")
        for shell in ["zsh", "fish"]:
            if shutil.which(shell):
                subprocess.run([shell, "-n", folder / f"rcsplat.{shell}"], check=True)
        pages = [said("manual"), *(said("manual", command) for command in ["render", "serve", "compare"])]
        for page in pages:
            for part in [".TH", ".SH NAME", ".SH SYNOPSIS", ".SH OPTIONS"]:
                expect(part in page, part)
            if shutil.which("groff"):
                done = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-"], input=page, capture_output=True,
                                      text=True)
                expect(done.returncode == 0 and not done.stderr, done.stderr)
        expect("--gradient-limit" in pages[1].replace("\\-", "-"), "the manual has every option")
    print("completions and manual pages are well")


main()
