#!/usr/bin/env python3
"""Opens the page of `rcsplat accuracy` in headless Chromium, uses it as a person does, and expects it to work.

usage: report_browser_test.py RCSPLAT        makes a small report and tests its page
       report_browser_test.py --page INDEX.HTML [--screenshots FOLDER]    tests a page there is, and shows it

Checked are: no request goes anywhere, nothing is logged as an error, every picture of every point loads, tabs, views
and slider work by keyboard, links of the plot choose points, light and dark have contrast, narrow windows do not
overflow. Exits with 77 where there is no Chromium.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

from browser import BROWSERS, SKIPPED, Browser, find_browser

failures = []


def expect(holds, what):
    if not holds:
        failures.append(what)
        print("FAILED:", what)


def check_quiet(browser):
    """No request but for the file itself, no error in the console."""
    for event in browser.events:
        params = event.get("params", {})
        if event.get("method") == "Network.requestWillBeSent":
            url = params["request"]["url"]
            expect(url.startswith("data:") or url.startswith("file:") and url.endswith("index.html"),
                   f"asks for {url[:200]}")
        elif event.get("method") == "Runtime.exceptionThrown":
            expect(False, f"script error: {params['exceptionDetails'].get('text')}")
        elif event.get("method") == "Runtime.consoleAPICalled":
            expect(False, f"writes to the console: {params.get('args')}")
        elif event.get("method") == "Log.entryAdded":
            expect(False, f"is logged: {params['entry']['text']}")


def check_contents(browser):
    count = lambda selector: browser.evaluate(f"document.querySelectorAll({json.dumps(selector)}).length")
    points = browser.evaluate("data.points.length")
    expect(points >= 3, "has points")
    for selector in ['[role="tab"]', "#plot a", "tbody tr"]:
        expect(count(selector) == points, f"{selector}: one for each of the {points} points")
    expect(" costs " in browser.evaluate("document.querySelector('.headline').textContent"),
           "the headline says what errors cost")
    for selector in ["#plot .front-point", "#plot .paths-point", "#plot .floor"]:
        expect(count(selector) >= 1, f"the plot shows {selector}")
    expect(browser.evaluate("[...document.images].every((image) => image.alt !== '')"),
           "every picture has an alternative text")
    expect(browser.evaluate("document.documentElement.lang") == "en", "the language is named")


def check_pictures(browser):
    """Every picture of every point decodes, at the size of the view."""
    broken = browser.evaluate("""(async () => {
        const bad = [];
        for (const [i, point] of data.points.entries()) {
            choose(i);
            for (const radio of views.filter((v) => !v.disabled)) {
                radio.click();
                const image = document.getElementById("over");
                await image.decode().catch(() => bad.push(`${i} ${radio.value}`));
                const width = Number(image.getAttribute("width"));
                if (image.naturalWidth !== image.width && image.naturalWidth !== width)
                    bad.push(`${i} ${radio.value} has another size`);
            }
            if (Boolean(point.images.records) === point.traced) bad.push(`${i}: records`);
        }
        document.querySelector('input[value="picture"]').click();
        await document.getElementById("under").decode().catch(() => bad.push("reference"));
        return bad.join(", ");
    })()""")
    expect(broken == "", f"pictures that do not load: {broken}")


def check_keyboard(browser):
    label = lambda: browser.evaluate("document.getElementById('label').textContent")
    last = browser.evaluate("data.points.length - 1")
    browser.evaluate("choose(0); tabs[0].focus()")
    first = label()
    browser.press("ArrowRight")
    expect(label() != first, "the right arrow goes to the next point")
    browser.press("End")
    expect(browser.evaluate("chosen") == last, "End goes to the last point")
    expect(browser.evaluate("document.activeElement.getAttribute('aria-selected')") == "true", "the focus follows")
    expect(browser.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none", "the focus is seen")
    expect(browser.evaluate("document.querySelector('input[value=records]').disabled"),
           "the path tracer has no records to show")
    browser.press("Home")
    expect(label() == first, "Home goes back to the first")

    browser.press("Tab")
    expect(browser.evaluate("document.activeElement.id") == "panel", "Tab leaves the tabs for their panel")
    browser.press("Tab")
    browser.press("ArrowRight")
    expect(browser.evaluate("views.find((v) => v.checked).value") == "indirect", "arrows choose the view")
    expect(browser.evaluate("!document.getElementById('slider').hidden"), "the indirect light has a slider")
    browser.press("Tab")
    expect(browser.evaluate("document.activeElement.id") == "split", "Tab goes on to the slider")
    clip = lambda: browser.evaluate("getComputedStyle(document.getElementById('over')).clipPath")
    before = clip()
    browser.press("ArrowRight")
    expect(clip() != before and browser.evaluate("document.getElementById('split').value") == "51",
           "arrows move the slider")
    browser.evaluate("views.find((v) => v.value === 'difference').click()")
    expect(browser.evaluate("document.getElementById('slider').hidden && !document.getElementById('scale').hidden"),
           "the heat map has a scale instead of a slider")
    browser.evaluate("views.find((v) => v.value === 'picture').click()")

    browser.evaluate("plotLinks[1].focus()")
    browser.press("Enter")
    expect(browser.evaluate("chosen") == 1, "a link of the plot chooses its point")


def check_schemes(browser):
    """Text stands out from its paper, by the contrast of WCAG 2.1 (4.5 for text)."""
    contrast = """(() => {
        const light = (css) => {
            const [r, g, b] = css.match(/[\\d.]+/g).slice(0, 3).map((v) => v / 255)
                .map((v) => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
            return 0.2126 * r + 0.7152 * g + 0.0722 * b;
        };
        const paper = light(getComputedStyle(document.body).backgroundColor);
        const colors = { text: getComputedStyle(document.body).color,
            muted: getComputedStyle(document.querySelector(".muted")).color,
            curve: getComputedStyle(document.querySelector("#plot .front-point")).fill,
            paths: getComputedStyle(document.querySelector("#plot .paths-point")).fill };
        const ratios = Object.entries(colors).map(([name, css]) => {
            const [low, high] = [paper, light(css)].sort((a, b) => a - b);
            return [name, (high + 0.05) / (low + 0.05)];
        });
        return { paper, ratios };
    })()"""
    papers = {}
    for scheme in ["light", "dark"]:
        browser.scheme(scheme)
        found = browser.evaluate(contrast)
        papers[scheme] = found["paper"]
        for name, ratio in found["ratios"]:
            expect(ratio >= 4.5, f"{name} has a contrast of {ratio:.1f} in the {scheme} scheme, 4.5 are wanted")
    expect(papers["light"] > 0.8 and papers["dark"] < 0.05, f"the paper follows the scheme: {papers}")
    browser.scheme("light")


def check_sizes(browser):
    for width in [360, 800, 1280]:
        browser.size(width, 900)
        wide = browser.evaluate("document.documentElement.scrollWidth")
        expect(wide <= width, f"a window of {width} px scrolls sideways: {wide} px")


def save_screenshots(browser, folder):
    """Those of docs/accuracy.md."""
    default = browser.evaluate("data.first")
    for name, scheme, view, place, height in [("curve", "light", "picture", "", 900),
                                              ("slider", "light", "picture", "point", 900),
                                              ("difference", "dark", "difference", "point", 900),
                                              ("records", "dark", "records", "point", 900)]:
        browser.size(1200, height)
        browser.scheme(scheme)
        browser.evaluate(f"choose({default}); document.activeElement.blur(); "
                         f"views.find((v) => v.value === '{view}').click()")
        browser.evaluate(f"document.getElementById('{place}').scrollIntoView()" if place else "scrollTo(0, 0)")
        browser.evaluate("document.getElementById('over').decode().then(() => new Promise(requestAnimationFrame))")
        browser.screenshot(folder / f"report-{name}.jpg")


def test_page(program, page, screenshots):
    with tempfile.TemporaryDirectory(prefix="rcs-browser-") as profile:
        browser = Browser(program, profile)
        try:
            browser.open(page.resolve().as_uri())
            browser.size(1200, 900)
            check_contents(browser)
            check_pictures(browser)
            check_keyboard(browser)
            check_schemes(browser)
            check_sizes(browser)
            check_quiet(browser)
            if screenshots:
                screenshots.mkdir(parents=True, exist_ok=True)
                save_screenshots(browser, screenshots)
        finally:
            browser.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rcsplat", nargs="?")
    parser.add_argument("--page", type=pathlib.Path)
    parser.add_argument("--screenshots", type=pathlib.Path)
    arguments = parser.parse_args()
    program = find_browser()
    if program is None:
        print("skipped: there is none of", ", ".join(BROWSERS))
        return SKIPPED
    if arguments.page:
        test_page(program, arguments.page, arguments.screenshots)
    else:
        with tempfile.TemporaryDirectory(prefix="rcs-report-") as folder:
            subprocess.run([arguments.rcsplat, "accuracy", "demo:cornell", "--size", "48x40", "--points",
                            "0.5:16:0.4,0.2:64:0.1", "--path-samples", "16,32", "--reference-error", "8", "-q", "-o",
                        folder],
                           check=True)
            test_page(program, pathlib.Path(folder) / "index.html", arguments.screenshots)
    print("FAILED" if failures else "all expectations hold")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
