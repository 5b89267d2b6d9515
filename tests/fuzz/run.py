#!/usr/bin/env python3
"""Builds the fuzzers with the preset "fuzz" and runs each for a while: 60 s in the slow tests, longer by hand.

    tests/fuzz/run.py --seeds build/release/bin/write_corpus [--seconds 1200] [--scenes ../shared/scenes] [--only draco]

By hand each run tries other inputs, and begins with those that earlier ones found worth keeping. The tests pass --seed:
as many inputs as TARGETS says, fewer where --seconds end first, from the seeds alone, the same ones each time, so that
what breaks them is a change of the sources.

Ends with 77 (skipped) where there is no clang with its fuzzing runtime (Debian: clang-14 libclang-rt-14-dev), with 0 if
no input was found that crashes, hangs or takes more than 4 GB.
"""

import argparse
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
HERE = ROOT / "tests" / "fuzz"
SKIPPED = 77
# Inputs with --seed: about a minute of each.
TARGETS = {"gltf": 15_000, "draco": 20_000, "image": 2_500, "records": 200_000, "frame": 100_000}


def clang():
    """The first clang++ that links a fuzzer."""
    for name in ("clang++", "clang++-19", "clang++-16", "clang++-15", "clang++-14"):
        path = shutil.which(name)
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "a.cpp"
            source.write_text('extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long)'
                              ' { return 0; }')
            if path and subprocess.run([path, "-fsanitize=fuzzer,address,undefined", source, "-o",
                                        source.with_suffix("")],
                                       capture_output=True).returncode == 0:
                return path
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", required=True, help="the program write_corpus")
    parser.add_argument("--scenes", help="folder with further scene files")
    parser.add_argument("--seconds", type=int, default=60, help="for each target")
    parser.add_argument("--seed", type=int, help="of the random inputs; the same ones each time")
    parser.add_argument("--only", choices=TARGETS, nargs="+", default=list(TARGETS))
    parser.add_argument("--build", default=ROOT / "build" / "fuzz", type=pathlib.Path)
    arguments = parser.parse_args()
    compiler = clang()
    if not compiler:
        print("skipped: there is no clang that links fuzzers")
        sys.exit(SKIPPED)
    subprocess.run(["cmake", "--preset", "fuzz", "-B", arguments.build, "-DCMAKE_CXX_COMPILER=" + compiler], cwd=ROOT,
                   check=True,
                   stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", arguments.build, "--target", *("fuzz_" + name for name in arguments.only)],
                   check=True,
                   stdout=subprocess.DEVNULL)
    corpus, seeds = arguments.build / "corpus", arguments.build / "seeds"
    subprocess.run([arguments.seeds, seeds], check=True)
    folders = [seeds, HERE.parent / "corpus"] + ([arguments.scenes] if arguments.scenes else [])
    subprocess.run([sys.executable, HERE / "make_seeds.py", *folders, "--out", corpus], check=True)
    failed = []
    for name in arguments.only:
        found = arguments.build / "found" / name
        with tempfile.TemporaryDirectory() as scratch:
            kept = pathlib.Path(scratch, "kept") if arguments.seed else arguments.build / "kept" / name
            for folder in (corpus / name, found, kept):
                folder.mkdir(parents=True, exist_ok=True)
            done = subprocess.run(
                [arguments.build / "bin" / ("fuzz_" + name), "-max_total_time=%d" % arguments.seconds, "-timeout=20",
                 "-rss_limit_mb=4096", "-malloc_limit_mb=4096", "-print_final_stats=1", "-verbosity=0",
                 "-close_fd_mask=1",
                 "-artifact_prefix=%s/" % found, "-seed=%d" % (arguments.seed or 0),
                 "-runs=%d" % (TARGETS[name] if arguments.seed else -1), kept, corpus / name],
                env=dict(os.environ, TMPDIR=scratch, ASAN_OPTIONS="detect_leaks=0:allocator_may_return_null=1"),
                stderr=subprocess.PIPE, text=True, errors="replace")
        stats = [line.split("::")[1].strip() for line in done.stderr.splitlines() if "number_of_executed_units" in line]
        print("%-6s %s, %s" % (name, "clean" if done.returncode == 0 else "FAILED",
                               stats[0] if stats else "no statistics"), flush=True)
        if done.returncode != 0:
            failed.append(name)
            print("\n".join(done.stderr.splitlines()[-40:]), flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
