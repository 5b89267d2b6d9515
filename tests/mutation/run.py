#!/usr/bin/env python3
"""Puts one deliberate fault after the other into a copy of the sources: each has to be caught by the stability suite.

    tests/mutation/run.py [--work DIR] [--only NAME ...] [--jobs N]
    tests/mutation/run.py --check      # only whether each still applies, and each of tests/bench/guards.json

faults.json lists them: the file, the text to replace, what with, and the cases (rcsplat doctor --case) that may catch
it. The copy is built once, then what each fault touches. Prints which cases caught each. Ends with 0 only if every
fault still applies, builds, and is caught, and the copy without faults passes. The checkout is never touched.
"""

import argparse
import json
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
MOST_SECONDS = 180  # a fault may make a loop endless
MOST_BYTES = 12 << 30


def copy_sources(target):
    """Brings the copy up to date without touching files that are the same, so that a build of it goes on."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                            check=True,
                            capture_output=True).stdout.decode().split("\0")
    for name in filter(None, listed):
        source, copy = ROOT / name, target / name
        if not source.is_file():
            continue
        if copy.is_file() and copy.read_bytes() == source.read_bytes():
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, copy)
        shutil.copymode(source, copy)


def build(source, folder, jobs):
    """@return None, or what the compiler said"""
    environment = dict(os.environ, CCACHE_BASEDIR=str(source), CCACHE_NOHASHDIR="1")
    if not (folder / "build.ninja").is_file():
        launcher = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
        subprocess.run(["cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
                        "-DRCS_BUILD_TESTS=OFF",
                        *launcher], check=True, stdout=subprocess.DEVNULL, env=environment)
    done = subprocess.run(["cmake", "--build", folder, "--target", "rcsplat", "-j", str(jobs)], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, env=environment)
    return None if done.returncode == 0 else "\n".join(done.stdout.splitlines()[-15:])


def limits():
    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def failing_cases(program, cases):
    """Each case in a process of its own: a fault may crash it. @return those that fail, with the reason"""
    caught = []
    for case in cases:
        try:
            done = subprocess.run([program, "doctor", "--json", "--case", case], capture_output=True, text=True,
                                  timeout=MOST_SECONDS, preexec_fn=limits, errors="replace")
        except subprocess.TimeoutExpired:
            caught.append((case, "no end in %d s" % MOST_SECONDS))
            continue
        if done.returncode == 0:
            continue
        if "there is no case" in done.stderr:
            sys.exit("error: %s" % done.stderr.strip())
        try:
            row = json.loads(done.stdout)["cases"][0]
            figure = "infinite" if row["figure"] is None else "%.2g" % row["figure"]
            caught.append((case, "%s, at most %.2g: %s" % (figure, row["tolerance"], row["measured"][:90])))
        except (ValueError, KeyError, IndexError):
            caught.append((case, "died with %d" % done.returncode))
    return caught


def check(changes):
    """Whether every change applies once to the checkout. @return 0, or 1 after saying which do not"""
    wrong = 0
    for change in changes:
        path = ROOT / change["file"]
        times = path.read_text().count(change["find"]) if path.is_file() else 0
        if times != 1:
            print("ERROR   %-28s applies %d times in %s" % (change["name"], times, change["file"]))
            wrong += 1
    print("%d of %d changes apply" % (len(changes) - wrong, len(changes)))
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--work", default=ROOT / "build" / "mutation", type=pathlib.Path, help="where the copy lies")
    parser.add_argument("--only", nargs="*", help="names of faults")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--check", action="store_true", help="only look whether each fault applies")
    arguments = parser.parse_args()
    faults = json.loads((HERE / "faults.json").read_text())
    if arguments.only:
        unknown = set(arguments.only) - {fault["name"] for fault in faults}
        if unknown:
            sys.exit("error: no fault is named " + ", ".join(sorted(unknown)))
        faults = [fault for fault in faults if fault["name"] in arguments.only]
    if arguments.check:
        sys.exit(check(faults + json.loads((ROOT / "tests" / "bench" / "guards.json").read_text())))
    source, folder = arguments.work.resolve() / "source", arguments.work.resolve() / "build"
    copy_sources(source)
    problem = build(source, folder, arguments.jobs)
    if problem:
        sys.exit("error: the copy does not build without a fault:\n" + problem)
    program = folder / "bin" / "rcsplat"
    every_case = sorted({case for fault in faults for case in fault["cases"]})
    wrong = failing_cases(program, every_case)
    if wrong:
        sys.exit("error: without a fault these fail: " + "; ".join("%s (%s)" % w for w in wrong))
    print("%d cases pass without a fault" % len(every_case), flush=True)
    missed = []
    for fault in faults:
        begin = time.monotonic()
        path = source / fault["file"]
        original = path.read_text()
        if original.count(fault["find"]) != 1:
            print("ERROR   %-28s applies %d times in %s" %
                  (fault["name"], original.count(fault["find"]), fault["file"]), flush=True)
            missed.append(fault["name"])
            continue
        path.write_text(original.replace(fault["find"], fault["replace"]))
        try:
            problem = build(source, folder, arguments.jobs)
            caught = [] if problem else failing_cases(program, fault["cases"])
        finally:
            path.write_text(original)
        if problem:
            print("ERROR   %-28s does not build:\n%s" % (fault["name"], problem), flush=True)
        elif not caught:
            print("MISSED  %-28s by %s" % (fault["name"], ", ".join(fault["cases"])), flush=True)
        if problem or not caught:
            missed.append(fault["name"])
            continue
        print("caught  %-28s by %s (%.0f s)" %
              (fault["name"], ", ".join(case for case, _ in caught), time.monotonic() - begin), flush=True)
        for case, words in caught:
            print("        %-28s %s: %s" % ("", case, words), flush=True)
    print("%d of %d faults caught" % (len(faults) - len(missed), len(faults)))
    build(source, folder, arguments.jobs)  # without a fault again, for the next run
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
