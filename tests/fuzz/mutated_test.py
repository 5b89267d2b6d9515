#!/usr/bin/env python3
"""200 damaged files through the rcsplat of this build: the slow tests' part of mutate_scenes.py.

    mutated_test.py RCSPLAT WRITE_CORPUS SCENES_FOLDER
"""

import pathlib
import subprocess
import sys
import tempfile

program, write_corpus, scenes = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    seeds = pathlib.Path(folder) / "seeds"
    subprocess.run([write_corpus, seeds], check=True)
    folders = [seeds] + ([scenes] if pathlib.Path(scenes).is_dir() else [])
    done = subprocess.run([sys.executable, pathlib.Path(__file__).with_name("mutate_scenes.py"), program, *folders,
                           "--count", "200",
                           "--keep", pathlib.Path(folder) / "kept"])
sys.exit(done.returncode)
