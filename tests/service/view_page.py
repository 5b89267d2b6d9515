"""A `rcsplat view` and its page in headless Chromium, for the test and the bench of it."""
import json
import pathlib
import subprocess
import tempfile
import time

from browser import Browser

# Watches the pixels of the picture itself, whatever the page says of them.
PROBE = """
(() => {
    const picture = document.getElementById("picture"), small = document.createElement("canvas");
    small.width = 80; small.height = 50;
    const context = small.getContext("2d", {willReadFrequently: true});
    let began = 0;
    for (const kind of ["pointermove", "wheel"]) addEventListener(kind, (event) => { began = event.timeStamp; }, true);
    const pixels = () => {
        context.drawImage(picture, 0, 0, small.width, small.height);
        return context.getImageData(0, 0, small.width, small.height).data;
    };
    const differs = (a, b) => a.some((value, i) => value !== b[i]);
    window.probe = {
        pixels: () => [...pixels()],
        /** Milliseconds from the next event to other pixels. */
        arm(patience) {
            const before = pixels();
            began = 0;
            window.probe.changed = new Promise((resolve) => {
                const end = performance.now() + patience;
                const look = () => {
                    const now = performance.now();
                    if (began > 0 && differs(before, pixels())) resolve(performance.now() - began);
                    else if (now > end) resolve(null);
                    else requestAnimationFrame(look);
                };
                look();
            });
        },
    };
})()
"""


class ViewPage:
    def __init__(self, rcsplat, program, *words, patience=120.0):
        self.folder = tempfile.TemporaryDirectory(prefix="rcs-view-")
        self.server = subprocess.Popen([rcsplat, "view", *words, "--log-level", "warning"], stdout=subprocess.PIPE,
                                       stderr=subprocess.PIPE, text=True)
        self.address = self.server.stdout.readline().strip()
        if not self.address:
            raise RuntimeError(self.server.stderr.read())
        self.patience = patience
        self.browser = Browser(program, self.folder.name + "/browser")

    def open(self, width=1100, height=720):
        self.browser.open(self.address)
        self.browser.size(width, height)
        self.browser.evaluate(PROBE)

    def data(self, name):
        return self.browser.evaluate(f"document.getElementById('picture').dataset.{name} || ''")

    def wait_for(self, holds, what):
        end = time.monotonic() + self.patience
        while time.monotonic() < end:
            if self.browser.evaluate(holds):
                return
            time.sleep(0.02)
        raise TimeoutError(what)

    def wait_until_done(self):
        """The picture at rest that the last look asked for."""
        self.wait_for("document.getElementById('picture').dataset.progress === 'done' && "
                      "Number(document.getElementById('picture').dataset.look) === number", "the picture is not done")

    def pixels(self):
        return self.browser.evaluate("probe.pixels()")

    def middle(self):
        box = self.browser.evaluate("(({left, top, width, height}) => [left, top, width, height])"
                                    "(document.getElementById('picture').getBoundingClientRect())")
        return box[0] + box[2] / 2, box[1] + box[3] / 2

    def timed(self, act, patience=5000):
        """Milliseconds from the input that `act` makes to other pixels; None: there were none."""
        self.browser.evaluate(f"probe.arm({patience})")
        act()
        return self.browser.evaluate("probe.changed")

    def command(self):
        return self.browser.evaluate("document.getElementById('command').value")

    def memory(self):
        """Resident memory of the program [MB]."""
        status = pathlib.Path(f"/proc/{self.server.pid}/status").read_text()
        return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1]) / 1024

    def errors(self):
        """What the page logged, and what it asked of others than the server."""
        own = self.address.split("/")[2]
        found = []
        for event in self.browser.events:
            params = event.get("params", {})
            if event.get("method") == "Network.requestWillBeSent":
                url = params["request"]["url"]
                if not url.startswith(("data:", "blob:")) and url.split("/")[2] != own:
                    found.append(f"asks for {url}")
            elif event.get("method") in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"):
                found.append(json.dumps(params)[:500])
        return found

    def close(self):
        self.browser.close()
        try:
            return self.server.wait(60)
        finally:
            self.server.kill()
            self.server.stdout.close()
            self.server.stderr.close()
            self.folder.cleanup()
