"""Looks at the status page of a real server in headless Chromium: status_page_test.py RCSPLAT; 77 where there is no
browser."""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

from browser import find_browser



def fetch(url: str, host: str = "") -> bytes:
    request = urllib.request.Request(url, headers={"Host": host} if host else {})
    with urllib.request.urlopen(request, timeout=10) as answer:
        return answer.read()


def status_of(url: str, host: str = "") -> int:
    try:
        fetch(url, host)
        return 200
    except urllib.error.HTTPError as error:
        return error.code


def wait_for(holds):
    for _ in range(2400):  # two minutes: the machine may be busy
        if holds():
            return
        time.sleep(0.05)
    raise SystemExit("waited too long")


def main() -> int:
    rcsplat = sys.argv[1]
    browser = find_browser()
    with tempfile.TemporaryDirectory(prefix="rcs-page-") as name:
        folder = pathlib.Path(name)
        log = folder / "log"
        socket = str(folder / "run/socket")
        with open(log, "w") as out:
            server = subprocess.Popen([rcsplat, "serve", "--socket", socket, "--state", folder / "state", "--http",
                                       "127.0.0.1:0"], stderr=out)
        try:
            wait_for(lambda: "event=worker_ready" in log.read_text())
            port = re.search(r"http=127.0.0.1 port=(\d+)", log.read_text())[1]
            page = f"http://127.0.0.1:{port}"

            def submit(*words: str) -> None:
                subprocess.run([rcsplat, "submit", *words, "--detach", "--server", socket], check=True,
                               stdout=subprocess.DEVNULL)

            def jobs() -> list:
                return json.loads(fetch(page + "/status.json"))["jobs"]

            submit("demo:cornell", "--size", "64x64", "--frames", "1-3", "-o", "a.####.exr", "--label", "shot=s1")
            submit("demo:cornell", "--camera", "<b>nowhere</b>", "--size", "16x16", "-o", "a.png")
            # A first pass that is soon there, and many more.
            submit("demo:atrium", "--size", "800x800", "--aa", "256", "--accuracy", "0.5", "--rays", "16", "-o",
                   "a.png")
            submit("demo:cornell", "--frames", "1-2", "-o", "b.####.png", "--after", "3")
            wait_for(lambda: len(jobs()) == 4 and jobs()[1]["running"] and "preview" in jobs()[1]["running"][0])
            by_number = {job["job"]: job for job in jobs()}
            assert by_number[1]["state"] == "completed", by_number[1]
            assert by_number[2]["state"] == "failed" and "nowhere" in by_number[2]["reason"], by_number[2]
            done = json.loads(fetch(page + "/frames/1/0"))["frames"]
            assert len(done) == 3 and done[0]["seconds"] > 0 and by_number[1]["labels"] == {"shot": "s1"}, done
            assert fetch(page + done[0]["files"][0]["path"]).startswith(b"\x76\x2f\x31\x01"), "the EXR itself"
            assert fetch(page + done[0]["thumbnail"]).startswith(b"\xff\xd8\xff"), "and a picture of it"
            assert json.loads(fetch(page + "/status.json/3"))["jobs"][0]["job"] == 2
            assert fetch(page + by_number[3]["running"][0]["preview"]).startswith(b"\xff\xd8\xff")
            assert by_number[4]["state"] == "queued" and by_number[4]["waits_for"] == [3], by_number[4]
            assert b"rcsplat_jobs_submitted_total 4\n" in fetch(page + "/metrics")
            assert status_of(page + "/etc/passwd") == 404
            assert status_of(page + "/picture/1/0/..%2f..%2fqueue.db") == 404
            assert status_of(page + "/picture/x/y/z") == 404
            assert status_of(page + "/thumbnail/3/0") == 404, "not done yet"
            assert status_of(page, "evil.example") == 403, "another site's name"
            assert re.findall(r"https?://", fetch(page + "/").decode()) == [], "the page refers to the network"
            if browser is None:
                print("no browser")
                return 77
            dom = subprocess.run(
                [browser, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/browser",
                 "--virtual-time-budget=3000",
                 "--dump-dom", page + "#job-1"], capture_output=True, text=True, timeout=120).stdout
            assert "serving; 1 of 1 workers busy" in dom, dom
            assert "waits for job 3" in dom, dom
            places = [dom.index(f'id="job-{number}"') for number in (2, 3, 4, 1)]
            assert places == sorted(places), "failures first, then what runs, what waits, what is done"
            assert 'aria-label="error over the frames 1 to 3: ' in dom and dom.count('src="/thumbnail/1/') == 3, dom
            assert 'shot: s1' in dom and 'class="reason"' in dom and '<details id="job-2" open' in dom, dom
            assert "&lt;b&gt;nowhere&lt;/b&gt;" in dom and "<b>nowhere</b>" not in dom, "names are text"
            assert 'class="preview"' in dom and "<progress" in dom, dom
            print("status page: all held")
            return 0
        finally:
            server.terminate()
            server.wait(60)


if __name__ == "__main__":
    sys.exit(main())
