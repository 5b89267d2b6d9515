"""Who is let into a live view, and what comes of messages, by raw sockets: view_visitors_test.py RCSPLAT."""

import base64
import json
import os
import pathlib
import shlex
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

PATIENCE = 120.0  # [s], on a machine that may be busy


class View:
    """A running `rcsplat view`."""

    def __init__(self, rcsplat, *words):
        self.process = subprocess.Popen([rcsplat, "view", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        text=True)
        self.address = self.process.stdout.readline().strip()
        assert self.address.startswith("http://127.0.0.1:"), self.address + self.process.stderr.read()
        self.host, self.path = self.address.split("/")[2], "/" + self.address.split("/")[3] + "/"
        self.port = int(self.host.split(":")[1])

    def ask(self, path=None, method="GET", **headers):
        """@return status, headers and body"""
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE) as link:
            lines = [f"{method} {self.path if path is None else path} HTTP/1.1"]
            wanted = {"Host": self.host, **headers}
            lines += [f"{name.replace('_', '-')}: {value}" for name, value in wanted.items() if value is not None]
            link.sendall(("\r\n".join(lines) + "\r\n\r\n").encode("latin-1"))
            data = b""
            while chunk := link.recv(65536):
                data += chunk
                if b" 101 " in data[:16] and b"\r\n\r\n" in data:
                    break
        head, body = data.split(b"\r\n\r\n", 1)
        return int(head.split()[1]), head.decode("latin-1"), body

    def status(self, *arguments, **headers):
        status, _, body = self.ask(*arguments, **headers)
        assert status != 403 or body.count(b"\n") == 1, body
        return status

    def ended(self):
        code = self.process.wait(PATIENCE)
        self.process.stdout.close()
        self.process.stderr.close()
        return code

    def stop(self):
        if self.process.poll() is None:
            self.process.kill()
            self.ended()


class Page:
    """A WebSocket (RFC 6455) as the page has one."""

    UPGRADE = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec_WebSocket_Version": "13",
               "Sec_WebSocket_Key": base64.b64encode(b"0123456789abcdef").decode()}

    def __init__(self, view):
        self.link = socket.create_connection(("127.0.0.1", view.port), timeout=PATIENCE)
        headers = {"Host": view.host, "Origin": f"http://{view.host}", **self.UPGRADE}
        request = [f"GET {view.path}socket HTTP/1.1"] + [f"{n.replace('_', '-')}: {v}" for n, v in headers.items()]
        self.link.sendall(("\r\n".join(request) + "\r\n\r\n").encode())
        self.data = b""
        while b"\r\n\r\n" not in self.data:
            self.data += self.link.recv(65536)
        head, self.data = self.data.split(b"\r\n\r\n", 1)
        assert b" 101 " in head, head
        self.number = 0

    def take(self, count):
        while len(self.data) < count:
            chunk = self.link.recv(65536)
            if not chunk:
                raise EOFError
            self.data += chunk
        taken, self.data = self.data[:count], self.data[count:]
        return taken

    def receive(self):
        """@return ("text", dict), ("frame", header, file) or ("close", code, reason)"""
        first, size = self.take(2)
        if size == 126:
            size = struct.unpack(">H", self.take(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self.take(8))[0]
        body, kind = self.take(size), first & 15
        if kind == 1:
            return "text", json.loads(body)
        if kind == 2:
            length = struct.unpack(">I", body[:4])[0]
            return "frame", json.loads(body[4:4 + length]), body[4 + length:]
        if kind == 8:
            return "close", struct.unpack(">H", body[:2])[0], body[2:].decode()
        return self.receive()

    def send_frame(self, body, kind=1):
        size = bytes([128 | len(body)]) if len(body) < 126 else struct.pack(">BH", 128 | 126, len(body))
        self.link.sendall(bytes([128 | kind]) + size + b"\0\0\0\0" + body)

    def send(self, message):
        self.send_frame(json.dumps(message).encode())

    def look(self, start, **changes):
        self.number += 1
        self.send({"look": {"number": self.number, **start, "error": 20, "exposure": None, "bounces": 1,
                            "layer": "picture", **changes}})

    def frame(self, wanted=lambda header: True):
        """Takes frames, as a page does, up to one that is wanted."""
        while True:
            what, *rest = self.receive()
            assert what != "close", rest
            if what == "frame":
                self.send({"shown": rest[0]["frame"]})
                if wanted(rest[0]):
                    return rest

    def closed(self):
        while True:
            what, *rest = self.receive()
            if what == "close":
                return rest


def check_door(view):
    upgrade = {**Page.UPGRADE, "Origin": f"http://{view.host}"}
    status, head, body = view.ask()
    assert status == 200 and b"<canvas" in body and b"http://" not in body and b"https://" not in body
    assert "Content-Security-Policy: default-src 'none'" in head and "unsafe-inline" not in head, head
    assert "Referrer-Policy: no-referrer" in head and "nosniff" in head
    assert view.status(Host=f"localhost:{view.port}") == 200
    for name in ("page.js", "page.css"):
        assert view.status(view.path + name) == 200
    for host in ("evil.example", f"evil.example:{view.port}", "127.0.0.1", f"127.0.0.1:{view.port + 1}", None):
        assert view.status(Host=host) == 403, host
    wrong = "/" + view.path[1:-2] + ("0" if view.path[-2] != "0" else "1") + "/"
    for path in ("/", wrong, wrong + "socket", view.path + "..", view.path + "page.html", "/socket"):
        assert view.status(path) == 403, path
    assert view.status(method="POST") == 403
    assert view.status(view.path + "socket") == 403, "no upgrade"
    assert view.status(view.path + "socket", **upgrade) == 101
    for origin in (None, "null", "http://evil.example", f"http://localhost:{view.port}", f"https://{view.host}"):
        assert view.status(view.path + "socket", **{**upgrade, "Origin": origin}) == 403, origin
    assert view.status(wrong + "socket", **upgrade) == 403
    assert view.status(view.path, **upgrade) == 403
    assert view.status("/" + "x" * 9000) == 400, "a header beyond what is read"
    with socket.create_connection(("127.0.0.1", view.port)) as link:
        link.sendall(b"\x16\x03\x01 no HTTP at all\r\n\r\n")
        assert b" 400 " in link.recv(4096)


def check_command_is_the_picture(rcsplat, view):
    """What the page copies makes the very bytes that it was shown, where light begins from nothing."""
    page = Page(view)
    start = page.receive()[1]["hello"]["start"]
    start["eye"][0] += 0.1234567890123
    page.look(start)
    page.frame(lambda header: header["progress"] == "done")
    page.send({"afresh": True})
    header, file = page.frame(lambda header: header["progress"] == "done")
    with tempfile.TemporaryDirectory(prefix="rcs-view-") as folder:
        words = shlex.split(header["command"])
        assert words[0] == "rcsplat", words
        subprocess.run([rcsplat, *words[1:], "-q"], check=True, cwd=folder, stderr=subprocess.DEVNULL)
        assert (pathlib.Path(folder) / "view.png").read_bytes() == file, header["command"]
    assert 0 < header["error"] <= 0.21, header
    page.look(start, layer="indirect", exposure=1.5)
    again, other = page.frame()
    assert again["progress"] == "done" and other != file, "shown otherwise, not rendered again"
    assert "--exposure 1.5" in again["command"]
    page.send({"pick": {"x": 0.5, "y": 0.5}})
    what, picked = page.receive()
    assert what == "text" and len(picked["picked"]) == 3, picked
    page.send({"job": True})
    assert "--server" in page.receive()[1]["job"]["error"]
    return page, start


def check_bad_messages(view, start):
    for message, why in (({"fly": 1}, "a message is fly"), ({"shown": -1}, "shown is -1"), ([], "no JSON object"),
                         ({"look": {**start, "number": 1}}, "error is missing")):
        page = Page(view)
        page.send(message)
        code, reason = page.closed()
        assert code == 1008 and why in reason, (code, reason)
    page = Page(view)
    page.send_frame(b"binary", 2)
    assert page.closed()[0] == 1008
    page = Page(view)
    page.send_frame(b"x" * 5000)
    assert page.closed()[0] == 1009, "longer than any message"


def check_take_over(view, page, start):
    other = Page(view)
    code, reason = page.closed()
    assert code == 4001 and "another page" in reason, (code, reason)
    other.receive()
    other.look(start)
    other.frame()
    return other


def check_cancelled_and_ended(view, page, start):
    """Closing the page ends the work: the processor is idle at once, and the program after its grace."""
    page.look({**start, "eye": [start["eye"][0], start["eye"][1], start["eye"][2] + 0.3]}, error=0.2, bounces=2)
    page.frame(lambda header: header["progress"] == "moving")
    time.sleep(1.0)
    assert view.process.poll() is None
    page.link.close()
    time.sleep(2.0)
    before, begin = os.times(), time.monotonic()
    ticks = lambda: sum(map(int, pathlib.Path(f"/proc/{view.process.pid}/stat").read_text().split()[13:15]))
    busy = ticks()
    time.sleep(1.0)
    busy = (ticks() - busy) / os.sysconf("SC_CLK_TCK") / (time.monotonic() - begin)
    assert busy < 0.3, f"it still works: {busy:.2f} of a core, {before}"
    assert view.ended() == 0


def check_job(rcsplat, words):
    """What is seen becomes a job of a render server."""
    with tempfile.TemporaryDirectory(prefix="rcs-view-") as name:
        place = str(pathlib.Path(name) / "socket")
        server = subprocess.Popen([rcsplat, "serve", "--socket", place, "--state", name + "/state"],
                                  stderr=subprocess.DEVNULL)
        view = View(rcsplat, *words, "--server", place)
        try:
            page = Page(view)
            hello = page.receive()[1]["hello"]
            assert hello["server"] == place, hello
            page.look(hello["start"], error=12.5)
            page.frame()
            while not pathlib.Path(place).exists():
                time.sleep(0.05)
            page.send({"job": True})
            told = {}
            while "job" not in told:
                what, *rest = page.receive()
                told = rest[0] if what == "text" else told
            assert told["job"] == {"number": 1}, told
            listed = json.loads(subprocess.run([rcsplat, "list", "1", "--server", place, "--json"], check=True,
                                               capture_output=True, text=True).stdout)
            assert "demo:cornell" in json.dumps(listed), listed
        finally:
            view.stop()
            server.terminate()
            server.wait(PATIENCE)


def main():
    rcsplat = str(pathlib.Path(sys.argv[1]).resolve())
    words = ("demo:cornell", "--size", "96x64", "--aa", "1", "--view", "ACES 1.0 SDR")
    view = View(rcsplat, *words)
    try:
        check_door(view)
        page, start = check_command_is_the_picture(rcsplat, view)
        page = check_take_over(view, page, start)
        check_bad_messages(view, start)
        page = Page(view)
        page.receive()
        check_cancelled_and_ended(view, page, start)
    finally:
        view.stop()
    view = View(rcsplat, *words, "--keep-open")
    try:
        Page(view).link.close()
        time.sleep(0.2)
        view.process.send_signal(signal.SIGINT)
        assert view.ended() == 130
    finally:
        view.stop()
    check_job(rcsplat, words)
    taken = subprocess.run([rcsplat, "view", "demo:cornell", "--target-error", "indirect=5%"], capture_output=True,
                           text=True, timeout=PATIENCE)
    assert taken.returncode == 2 and "--target-error" in taken.stderr, taken
    print("view: all held")
    return 0


if __name__ == "__main__":
    sys.exit(main())
