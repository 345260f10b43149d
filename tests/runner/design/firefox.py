"""Controls a Firefox with Marionette, the protocol of its geckodriver, on a display in memory: without one it has no WebGL."""

import contextlib
import json
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "display"))
from virtual_screen import NEEDED, VirtualScreen  # noqa: E402

KEYS = {"Tab": "\ue004", "Enter": "\ue007", "Escape": "\ue00c", "End": "\ue010", "Home": "\ue011", "ArrowUp": "\ue013", "ArrowDown": "\ue015",
        "Backspace": "\ue003", "Alt": "\ue00a", "Control": "\ue009", "Shift": "\ue008"}
# Nothing of the browser's own comes over the network or between the tests and the page.
PREFERENCES = {"app.update.enabled": False, "browser.shell.checkDefaultBrowser": False, "browser.startup.page": 0, "datareporting.policy.dataSubmissionEnabled": False,
               "dom.disable_beforeunload": True, "network.captive-portal-service.enabled": False, "network.connectivity-service.enabled": False,
               "webgl.force-enabled": True}


def find():
    """Path of an installed Firefox, or None; None as well without a display in memory."""
    if any(shutil.which(tool) is None for tool in NEEDED):
        return None
    return shutil.which("firefox-esr") or shutil.which("firefox")


class Firefox:
    """A browser with one page. Its methods are those of chromium.Chromium."""

    PATIENCE = 120  # s until a missing reply counts as a hang
    NARROWEST = 450  # px; its windows become no narrower

    def __init__(self):
        self.profile = tempfile.mkdtemp(prefix="palpate-firefox-")
        with open(self.profile + "/user.js", "w", encoding="utf-8") as file:
            file.writelines(f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in {**PREFERENCES, "marionette.port": 0}.items())
        self.screen = VirtualScreen("2200x1400")
        self.process = subprocess.Popen(
            [find(), "--marionette", "--remote-allow-system-access", "--no-remote", "--profile", self.profile, "about:blank"],
            env={**self.screen.environment, "HOME": self.profile, "MOZ_CRASHREPORTER_DISABLE": "1"}, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        port = self._port()
        self.socket = socket.create_connection(("127.0.0.1", port), self.PATIENCE)
        self.stream = self.socket.makefile("rwb")
        self.number = 0
        self._receive()
        self.call("WebDriver:NewSession", capabilities={"alwaysMatch": {"unhandledPromptBehavior": "accept"}})
        self.chrome("""
            window.palpateRequests = [];
            Services.obs.addObserver(subject => {
              const channel = subject.QueryInterface(Ci.nsIHttpChannel);
              if (!channel.isDocument && channel.loadInfo.triggeringPrincipal?.isContentPrincipal) window.palpateRequests.push(channel.URI.spec);
            }, 'http-on-modify-request');""")

    def _port(self):
        """Firefox writes the port it has taken into its profile."""
        end = time.monotonic() + self.PATIENCE
        while time.monotonic() < end and self.process.poll() is None:
            with contextlib.suppress(OSError, ValueError), open(self.profile + "/MarionetteActivePort", encoding="ascii") as file:
                return int(file.read())
            time.sleep(0.05)
        raise RuntimeError("Firefox does not start")

    def _receive(self):
        length = b""
        while (letter := self.stream.read(1)) != b":":
            if not letter:
                raise RuntimeError("Firefox has ended")
            length += letter
        return json.loads(self.stream.read(int(length)))

    def call(self, method, **params):
        self.number += 1
        message = json.dumps([0, self.number, method, params]).encode()
        self.stream.write(str(len(message)).encode() + b":" + message)
        self.stream.flush()
        _, number, error, result = self._receive()
        if number != self.number or error:
            raise RuntimeError(f"{method}: {error}")
        return result

    def chrome(self, script):
        """Runs a script with the browser's own rights."""
        self.call("Marionette:SetContext", value="chrome")
        try:
            return self.call("WebDriver:ExecuteScript", script=script, args=[], sandbox=None)["value"]
        finally:
            self.call("Marionette:SetContext", value="content")

    def open_url(self, url):
        self.chrome("Services.console.reset(); window.palpateRequests.length = 0;")
        self.call("WebDriver:Navigate", url="about:blank")  # another fragment alone would load nothing
        self.call("WebDriver:Navigate", url=url)

    def reload(self):
        self.call("WebDriver:Refresh")

    def run(self, script):
        """Evaluates an expression in the page; awaits promises."""
        answer = self.call("WebDriver:ExecuteAsyncScript", args=[], sandbox=None, newSandbox=False, scriptTimeout=1000 * self.PATIENCE, script=f"""
            const done = arguments[arguments.length - 1];
            const text = {json.dumps(script)};
            (async () => eval(text))().then(value => done({{value: value === undefined ? null : JSON.parse(JSON.stringify(value))}}),
                                                   error => done({{error: String(error), stack: error.stack}}));""")["value"]
        if "error" in answer:
            raise RuntimeError(json.dumps(answer))
        return answer["value"]

    def press(self, key, modifiers):
        held = [KEYS[one] for one in modifiers]
        code = KEYS.get(key, key)
        actions = [{"type": "keyDown", "value": one} for one in (*held, code)] + [{"type": "keyUp", "value": one} for one in (code, *reversed(held))]
        self.call("WebDriver:PerformActions", actions=[{"type": "key", "id": "keyboard", "actions": actions}])

    def insert(self, text):
        self.run(f"document.execCommand('insertText', false, {json.dumps(text)})")

    @contextlib.contextmanager
    def without_webgl(self):
        self.chrome("Services.prefs.setBoolPref('webgl.disabled', true);")
        try:
            yield
        finally:
            self.chrome("Services.prefs.clearUserPref('webgl.disabled');")

    def complaints(self):
        """Errors and warnings of the page's scripts, console and security policy."""
        return self.chrome("""
            return Services.console.getMessageArray().filter(one => one instanceof Ci.nsIScriptError && one.innerWindowID !== 0)
                .map(one => `${one.errorMessage} ${one.sourceName}:${one.lineNumber}`);""")

    def requests(self):
        """URLs requested by the page, without its own."""
        return self.chrome("return window.palpateRequests;")

    def window(self, width, height, dark=False):
        self.chrome(f"Services.prefs.setIntPref('layout.css.prefers-color-scheme.content-override', {0 if dark else 1});")
        for _ in range(2):  # the frame's size is known once a window has one
            inner = self.run("[outerWidth - innerWidth, outerHeight - innerHeight]")
            self.call("WebDriver:SetWindowRect", width=max(width, self.NARROWEST) + inner[0], height=height + inner[1])

    def close(self):
        with contextlib.suppress(RuntimeError, OSError):
            self.call("Marionette:Quit", flags=["eForceQuit"])
        self.socket.close()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.screen.close()
        shutil.rmtree(self.profile, ignore_errors=True)
