#!/usr/bin/env python3
"""How long the live view takes from an input to the pixels, in headless Chromium.

usage: view_walk.py RCSPLAT [--scene SCENE] [--camera NAME] [--steps 200] [--minutes 0] [--screenshots FOLDER] [-o FILE]

The walk is the same every time: turns of the head, steps forward by the wheel, orbits. Each step waits for other pixels
of the canvas than before; what is told is the time from the input event, as the browser stamps it, to those. Then the
camera rests: what is told is the time until the page says an error of no more than --error, of the picture and of its
indirect light as well. With --minutes the walk goes on for so long, and the program's memory is told every ten seconds.
"""
import argparse
import json
import pathlib
import statistics
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "service"))

from browser import BROWSERS, SKIPPED, find_browser  # noqa: E402
from view_page import ViewPage  # noqa: E402


class Walk:
    """Where the pointer is, and what comes next."""

    def __init__(self, page):
        self.page, self.step = page, 0
        self.x, self.y = page.middle()
        self.button = None

    def press(self, button):
        if self.button == button:
            return
        self.release()
        mask = {"left": 1, "right": 2}[button]
        self.page.browser.mouse("mousePressed", self.x, self.y, button=button, buttons=mask, clickCount=1)
        self.button = button

    def release(self):
        if self.button:
            self.page.browser.mouse("mouseReleased", self.x, self.y, button=self.button, clickCount=1)
        self.button = None

    def next(self):
        """One step: the milliseconds that it took."""
        part = self.step // 10 % 4
        self.step += 1
        browser = self.page.browser
        if part == 1:  # forward
            self.release()
            return self.page.timed(lambda: browser.mouse("mouseWheel", self.x, self.y, deltaX=0, deltaY=-25))
        self.press("left" if part == 3 else "right")
        there = 1 if self.step // 40 % 2 == 0 else -1
        self.x += 6 * there * (1 if part != 2 else -0.5)
        self.y += 1.5 * there * (1 if part == 0 else -1)
        mask = {"left": 1, "right": 2}[self.button]
        return self.page.timed(lambda: browser.mouse("mouseMoved", self.x, self.y, button=self.button, buttons=mask))


def rest(page, error, begin, patience=60.0):
    """Seconds until the picture's error, until that of its indirect light as well, and until all is done."""
    found = {"picture": None, "both": None, "done": None}
    while time.monotonic() < begin + patience and found["done"] is None:
        progress, picture, indirect = page.browser.evaluate(
            "(({progress, error, indirect}) => [progress, Number(error), Number(indirect)])"
            "(document.getElementById('picture').dataset)")
        now = time.monotonic() - begin
        if progress in ("refining", "done"):
            if found["picture"] is None and picture <= error:
                found["picture"] = now
            if found["both"] is None and max(picture, indirect) <= error:
                found["both"] = now
            if progress == "done":
                found["done"] = now
        time.sleep(0.02)
    return found


def measure(arguments, program):
    words = [arguments.scene, "--size", arguments.size, "--target-error", f"{arguments.error}%"]
    if arguments.camera:
        words += ["--camera", arguments.camera]
    begin = time.monotonic()
    page = ViewPage(arguments.rcsplat, program, *words)
    result = {"scene": arguments.scene, "size": arguments.size}
    try:
        page.open()
        page.wait_for("document.getElementById('picture').dataset.progress", "there is no picture")
        result["first_picture_s"] = round(time.monotonic() - begin, 2)
        result["first_rest_s"] = rest(page, arguments.error / 100, time.monotonic())
        walk = Walk(page)
        times = [walk.next() for _ in range(arguments.steps)]
        stopped = time.monotonic()
        seen = sorted(t for t in times if t is not None)
        result["steps"] = len(times)
        result["steps_without_change"] = times.count(None)
        result["median_ms"] = round(statistics.median(seen), 1)
        result["p95_ms"] = round(seen[int(0.95 * (len(seen) - 1))], 1)
        result["rest_s"] = rest(page, arguments.error / 100, stopped)
        if arguments.screenshots:
            arguments.screenshots.mkdir(parents=True, exist_ok=True)
            page.browser.screenshot(arguments.screenshots / "view.jpg")
        result["memory_mb"] = [round(page.memory())]
        end, told = time.monotonic() + 60 * arguments.minutes, time.monotonic()
        while time.monotonic() < end:
            walk.next()
            x, y = page.middle()
            if abs(walk.x - x) > 300 or abs(walk.y - y) > 150:
                walk.release()
                walk.x, walk.y = x, y
            if walk.step % 400 == 0:
                page.browser.evaluate("document.getElementById('reset').click()")
            if time.monotonic() > told + 10:
                told = time.monotonic()
                result["memory_mb"].append(round(page.memory()))
        walk.release()
        result["walked"] = walk.step
        result["page_errors"] = page.errors()
    finally:
        result["exit_code"] = page.close()
    result["load"] = pathlib.Path("/proc/loadavg").read_text().split()[0]
    return result


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("--scene", default="demo:atrium")
    parser.add_argument("--camera", default="")
    parser.add_argument("--size", default="640x400")
    parser.add_argument("--error", type=float, default=10.0, help="[%%]")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--minutes", type=float, default=0.0)
    parser.add_argument("--screenshots", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path)
    arguments = parser.parse_args()
    program = find_browser()
    if program is None:
        print("skipped: there is none of", ", ".join(BROWSERS))
        return SKIPPED
    text = json.dumps(measure(arguments, program), indent=2)
    print(text)
    if arguments.output:
        arguments.output.write_text(text + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
