"""Drags the mouse over a live view in headless Chromium and looks at the pixels: view_browser_test.py RCSPLAT; 77 where
there is no browser."""

import sys

from browser import BROWSERS, SKIPPED, find_browser
from view_page import ViewPage


def difference(a, b):
    """Mean over values of 0 to 255."""
    return sum(abs(x - y) for x, y in zip(a, b)) / len(a)


def drag(page, dx, dy, steps, button="left"):
    """@return milliseconds from each step to other pixels"""
    x, y = page.middle()
    mask = {"left": 1, "right": 2}[button]
    page.browser.mouse("mousePressed", x, y, button=button, buttons=mask, clickCount=1)
    times = []
    for step in range(1, steps + 1):
        times.append(page.timed(lambda: page.browser.mouse("mouseMoved", x + dx * step / steps, y + dy * step / steps,
                                                           button=button, buttons=mask)))
    page.browser.mouse("mouseReleased", x + dx, y + dy, button=button, clickCount=1)
    return times


def check_drag(page):
    page.wait_until_done()
    begin = page.pixels()
    assert max(begin) > 100, "there is light"
    times = drag(page, 160, 30, 8)
    assert None not in times, f"each step of a drag is seen: {times}"
    assert page.data("progress") == "moving"
    page.wait_until_done()
    turned = page.pixels()
    assert difference(begin, turned) > 5.0, "the view has turned"
    assert float(page.data("error")) <= 0.2
    page.browser.evaluate("document.getElementById('reset').click()")
    page.wait_until_done()
    assert difference(begin, page.pixels()) < 2.0, "back where it began, in the same light"
    return begin


def check_touch(page, begin):
    """One finger orbits, two come nearer."""
    x, y = page.middle()

    def touch(kind, *places):
        page.browser.call("Input.dispatchTouchEvent", type=kind,
                          touchPoints=[{"x": px, "y": py, "id": i} for i, (px, py) in enumerate(places)])

    touch("touchStart", (x, y))
    touch("touchMove", (x + 60, y))
    touch("touchEnd")
    page.wait_until_done()
    assert difference(begin, page.pixels()) > 2.0, "a finger orbits"
    distance = "Math.hypot(...camera.eye.map((value, i) => value - camera.target[i]))"
    before = page.browser.evaluate(distance)
    touch("touchStart", (x - 40, y), (x + 40, y))
    for apart in (50, 60, 70, 80):
        touch("touchMove", (x - apart, y), (x + apart, y))
    touch("touchEnd")
    assert page.browser.evaluate(distance) < 0.8 * before, "two fingers come nearer"
    page.browser.evaluate("document.getElementById('reset').click()")
    page.wait_until_done()


def check_keys(page, begin):
    page.browser.evaluate("document.getElementById('picture').focus()")
    page.browser.hold("w", "KeyW")
    page.wait_for("Math.abs(camera.eye[2] - hello.start.eye[2]) > 0.2", "W does not walk")
    page.browser.hold("w", "KeyW", down=False)
    page.wait_until_done()
    assert difference(begin, page.pixels()) > 2.0
    page.browser.hold("r", "KeyR")
    page.browser.hold("r", "KeyR", down=False)
    page.wait_until_done()
    assert difference(begin, page.pixels()) < 2.0, "R goes back"


def check_controls(page, begin):
    layer = lambda name: page.browser.evaluate(f"document.querySelector('input[value={name}]').click()")
    for name in ("indirect", "direct", "error", "records"):
        shown = page.timed(lambda: page.browser.evaluate(
            f"dispatchEvent(new Event('wheel')); document.querySelector('input[value={name}]').click()"))
        assert shown is not None, f"{name} looks like what was there"
        assert page.data("progress") == "done", "another layer is nothing to render"
    layer("picture")
    page.browser.evaluate("""(() => {
        const slider = document.getElementById("exposure");
        slider.value = Number(slider.value) + 3;
        slider.dispatchEvent(new Event("input", {bubbles: true}));
    })()""")
    page.wait_until_done()
    assert sum(page.pixels()) > 1.2 * sum(begin), "brighter"
    assert not page.browser.evaluate("document.getElementById('auto').checked")
    assert page.browser.evaluate("document.getElementById('job').disabled && "
                                 "document.getElementById('job').title.includes('--server')")
    command = page.command()
    assert command.startswith("rcsplat render demo:cornell "), command
    assert "--eye" in command and "--exposure" in command, command


def check_widths(page):
    for width, height in ((1100, 720), (600, 800), (330, 640)):
        page.browser.size(width, height)
        assert page.browser.evaluate("document.documentElement.scrollWidth <= innerWidth"), f"{width} px overflow"
    unnamed = page.browser.evaluate("""[...document.querySelectorAll("input, select, textarea, button")]
        .filter((one) => !(one.labels && one.labels.length) && !one.textContent).map((one) => one.id)""")
    assert unnamed == [], f"without a name: {unnamed}"


def main():
    program = find_browser()
    if program is None:
        print("skipped: there is none of", ", ".join(BROWSERS))
        return SKIPPED
    page = ViewPage(sys.argv[1], program, "demo:cornell", "--size", "160x100", "--aa", "1", "--target-error", "15%")
    try:
        page.open()
        begin = check_drag(page)
        check_touch(page, begin)
        check_keys(page, begin)
        check_controls(page, begin)
        check_widths(page)
        assert page.errors() == [], page.errors()
    finally:
        code = page.close()
    assert code == 0, f"closing the page ends the command, with {code}"
    print("view: all held")
    return 0


if __name__ == "__main__":
    sys.exit(main())
