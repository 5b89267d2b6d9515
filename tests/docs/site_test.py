#!/usr/bin/env python3
"""The documentation's site is built without a warning, its links resolve, and its pages fit wide and narrow windows.

usage: site_test.py [BUILT_SITE]    Exits with 77 where docs/build has made no environment yet.
"""
import html.parser
import pathlib
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests/service"))
from report_browser_test import BROWSERS, SKIPPED, Browser  # noqa: E402

PAGES = ["index.html", "stages.html", "commands.html", "formats.html"]


class Links(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.targets, self.anchors = [], set()

    def handle_starttag(self, tag, attributes):
        for name, value in attributes:
            if name in ("href", "src") and value:
                self.targets.append(value)
            if name in ("id", "name") and value:
                self.anchors.add(value)


def links_of(page):
    links = Links()
    links.feed(page.read_text(errors="replace"))
    return links


def broken_links(site, has_api):
    parsed = {page: links_of(page) for page in site.glob("*.html")}
    for page, links in parsed.items():
        for target in links.targets:
            parts = urllib.parse.urlsplit(target)
            if parts.scheme in ("http", "https", "data", "mailto") or target.startswith("javascript:"):
                continue
            file = (page.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else page
            if file.parts[-2:] == ("api", "index.html") and not has_api or page.name == "404.html":
                continue
            if not file.exists():
                yield f"{page.name}: {target} leads nowhere"
            elif parts.fragment and file in parsed and parts.fragment not in parsed[file].anchors:
                yield f"{page.name}: {target} has no such place"


def too_wide(site):
    program = next(filter(None, map(shutil.which, BROWSERS)), None)
    if program is None:
        return
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(program, profile)
        try:
            for name in PAGES:
                browser.open((site / name).as_uri())
                for width in (1280, 390):
                    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1,
                                 mobile=False)
                    if browser.evaluate("document.scrollingElement.scrollWidth") > width:
                        yield f"{name} is wider than a window of {width} px"
        finally:
            browser.process.kill()
            browser.process.wait()


def main():
    if len(sys.argv) > 1:
        site = pathlib.Path(sys.argv[1]).resolve()
    else:
        if not (ROOT / "build/docs-venv/bin/mkdocs").exists():
            print("skipped: docs/build has made no environment yet")
            return SKIPPED
        subprocess.run([ROOT / "docs/build", "--offline"], check=True)
        site = ROOT / "build/site"
    wrong = [*broken_links(site, shutil.which("doxygen") is not None), *too_wide(site)]
    print("\n".join(wrong) or "every link resolves, pages fit")
    return 1 if wrong else 0


sys.exit(main())
