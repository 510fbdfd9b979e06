"""A browser without a window, spoken to over pipes by its DevTools protocol; tests that need one are skipped without it."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time

import pytest

BROWSER = shutil.which("chromium") or shutil.which("google-chrome") or shutil.which("chrome")
FLAGS = [
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe", "--window-size=1280,800", "--hide-scrollbars",
]  # fmt: skip
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no chromium or google-chrome on this machine")
_PATIENCE = 120.0  # s, for an answer


class Page:
    """A page in a browser: `said` are its messages and errors, `requests` what it fetched but itself."""

    def __init__(self, folder):
        read, self._send = os.pipe()
        self._receive, write = os.pipe()
        os.set_blocking(self._receive, False)
        own = [f"--user-data-dir={folder}", "about:blank"]
        # The browser reads from descriptor 3 and writes to 4.
        move = lambda: (os.dup2(read, 13), os.dup2(write, 14), os.dup2(13, 3), os.dup2(14, 4))  # noqa: E731
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "close_fds": False}
        self._process = subprocess.Popen([BROWSER, *FLAGS, *own], preexec_fn=move, **quiet)
        os.close(read), os.close(write)
        self._number, self._buffer, self._session = 0, b"", None
        self.said, self.requests = [], []
        target = next(t for t in self._wait_for_targets() if t["type"] == "page")
        self._session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Network", "Page"):
            self.call(f"{domain}.enable")

    def _wait_for_targets(self):
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            targets = self.call("Target.getTargets")["targetInfos"]
            if any(t["type"] == "page" for t in targets):
                return targets
        raise TimeoutError("the browser opens no page")

    def call(self, method, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._send, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            for answer in self._messages():
                if answer.get("id") == self._number:
                    assert "error" not in answer, answer
                    return answer["result"]
                self._note(answer)
        raise TimeoutError(method)

    def _messages(self):
        try:
            self._buffer += os.read(self._receive, 1 << 20)
        except BlockingIOError:
            time.sleep(0.005)
        *whole, self._buffer = self._buffer.split(b"\0")
        # What follows an answer is kept for the next call.
        for k, text in enumerate(whole):
            answer = json.loads(text)
            if answer.get("id") == self._number:
                self._buffer = b"\0".join([*whole[k + 1 :], self._buffer])
                yield answer
                return
            yield answer

    def _note(self, event):
        kind, what = event.get("method"), event.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.said.append(
                what["exceptionDetails"].get("exception", {}).get("description", what["exceptionDetails"]["text"])
            )
        elif kind == "Runtime.consoleAPICalled":
            self.said.append(str([of.get("value") for of in what["args"]]))
        elif kind == "Log.entryAdded":
            self.said.append(what["entry"]["text"])
        elif kind == "Network.requestWillBeSent" and what["request"]["url"] != self._url:
            self.requests.append(what["request"]["url"])

    def open(self, path):
        self._url = path.as_uri()
        self.call("Page.navigate", url=self._url)
        self.until("document.body && document.body.dataset.ready === 'yes' || document.readyState === 'complete'")
        return self

    def value(self, expression):
        """What a JavaScript expression gives; promises are waited for."""
        found = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def until(self, expression):
        """Wait until an expression is true."""
        end = time.monotonic() + _PATIENCE
        while not self.value(expression):
            assert time.monotonic() < end, (expression, self.said)
            time.sleep(0.02)

    def click(self, selector):
        """A click of the mouse on an element."""
        box = f"document.querySelector({json.dumps(selector)}).getBoundingClientRect()"
        x, y = self.value(f"(() => {{ const b = {box}; return [b.x + b.width / 2, b.y + b.height / 2]; }})()")
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def drag(self, x, y, dx, dy):
        """The mouse pressed at a place and moved."""
        steps = [("mousePressed", x, y), ("mouseMoved", x + dx / 2, y + dy / 2), ("mouseMoved", x + dx, y + dy)]
        for kind, px, py in [*steps, ("mouseReleased", x + dx, y + dy)]:
            self.call("Input.dispatchMouseEvent", type=kind, x=px, y=py, button="left", buttons=1, clickCount=1)

    def picture(self):
        """The page as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def close(self):
        self._session = None
        self.call("Browser.close")
        self._process.wait(_PATIENCE)
        os.close(self._send), os.close(self._receive)
