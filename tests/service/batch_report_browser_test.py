#!/usr/bin/env python3
"""Opens the report of `rcsplat batch` in headless Chromium, uses it as a person does, and expects it to work.

usage: batch_report_browser_test.py RCSPLAT [--screenshots FOLDER]

Checked are: no request goes anywhere, nothing is logged as an error, the strip has every frame that is there and
plays, slider and contact sheet choose frames, what failed stands first with its reason, curves are drawn, narrow
windows do not overflow. Exits with 77 where there is no Chromium.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile
import time

from browser import BROWSERS, PATIENCE, SKIPPED, Browser, find_browser

WALK = {"fps": 24, "keys": [{"frame": 1, "eye": [0, 0.5, 3], "target": [0, 0, 0]},
                            {"frame": 6, "eye": [1, 0.5, 3], "target": [0, 0, 0]},
                            {"frame": 7, "camera": "</script><b>nowhere"},
                            {"frame": 8, "eye": [1, 0.5, 3], "target": [0, 0, 0]}]}
failures = []


def expect(holds, what):
    if not holds:
        failures.append(what)
        print("FAILED:", what)


def wait_until(browser, expression, what):
    end = time.monotonic() + PATIENCE
    while not browser.evaluate(expression):
        if time.monotonic() > end:
            return expect(False, what)
        time.sleep(0.01)


def check_contents(browser):
    expect("7 of 8 frames are there, 1 failed" in browser.evaluate("document.querySelector('.headline').innerText"),
           "the headline counts")
    first = browser.evaluate("document.querySelector('main section').innerText")
    expect("Frames that are not there" in first and "<b>nowhere" in first, f"failures come first: {first}")
    expect(browser.evaluate("document.querySelectorAll('tbody tr').length") == 1 + 8, "a row for each frame")
    expect(browser.evaluate("document.querySelectorAll('.curves svg polyline').length") >= 4, "curves")
    expect(browser.evaluate("document.querySelectorAll('#sheet img').length") == 7, "a picture of each frame")
    expect(browser.evaluate("[...document.images].every(i => i.complete && i.naturalWidth > 0)"), "pictures load")
    expect(browser.evaluate("document.querySelector('pre').innerText").startswith("rcsplat batch"), "the command")


def check_player(browser):
    caption = "document.getElementById('caption').innerText"
    expect(browser.evaluate(caption).startswith("frame 1,"), "the first frame is shown")
    browser.evaluate("document.querySelectorAll('#sheet button')[4].click()")
    expect(browser.evaluate(caption).startswith("frame 5,"), "the sheet chooses")
    browser.evaluate("document.getElementById('position').focus()")
    browser.press("ArrowRight")
    expect(browser.evaluate(caption).startswith("frame 6,"), "the slider goes on by a key")
    browser.evaluate("document.getElementById('play').click()")
    wait_until(browser, f"{caption}.startsWith('frame 8,')", "it plays")
    wait_until(browser, f"{caption}.startsWith('frame 2,')", "and begins again")
    browser.evaluate("document.getElementById('play').click()")
    expect(browser.evaluate("document.getElementById('play').innerText") == "Play", "it stops")


def check_quiet(browser):
    for event in browser.events:
        params = event.get("params", {})
        if event.get("method") == "Network.requestWillBeSent":
            url = params["request"]["url"]
            expect(url.startswith("data:") or url.endswith("report.html"), f"asks for {url[:200]}")
        elif event.get("method") in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"):
            expect(False, f"{event['method']}: {params}")


def test_page(program, page, screenshots):
    with tempfile.TemporaryDirectory(prefix="rcs-browser-") as profile:
        browser = Browser(program, profile)
        try:
            browser.open(page.resolve().as_uri())
            browser.size(1200, 900)
            check_contents(browser)
            check_player(browser)
            for width in (1600, 800, 360):
                browser.size(width, 800)
                expect(browser.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"{width} px: overflows")
            check_quiet(browser)
            if screenshots:
                for scheme in ("light", "dark"):
                    browser.scheme(scheme)
                    browser.size(1200, 1900)
                    browser.screenshot(screenshots / f"batch-{scheme}.jpg")
        finally:
            browser.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat")
    parser.add_argument("--screenshots", type=pathlib.Path)
    arguments = parser.parse_args()
    program = find_browser()
    if program is None:
        print("skipped: there is none of", ", ".join(BROWSERS))
        return SKIPPED
    with tempfile.TemporaryDirectory(prefix="rcs-batch-") as folder:
        folder = pathlib.Path(folder)
        (folder / "walk.json").write_text(json.dumps(WALK))
        ended = subprocess.run([arguments.rcsplat, "batch", "demo:furnace", "--camera-path", folder / "walk.json",
                                "--frames", "1-8", "--size", "48x32", "--aa", "1", "--rays", "16", "-q", "-o",
                                folder / "f.####.png"], stderr=subprocess.DEVNULL)
        expect(ended.returncode == 1, "a frame fails")
        test_page(program, folder / "report.html", arguments.screenshots)
    print("FAILED" if failures else "all expectations hold")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
