"""A headless Chromium with a keyboard, for the tests of this folder; see firefox.py for the other browser."""

import contextlib
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "analysis" / "report"))
import report_chromium  # noqa: E402
from report_chromium import find  # noqa: E402,F401

KEYS = {"Tab": 9, "Enter": 13, "Escape": 27, "End": 35, "Home": 36, "ArrowDown": 40, "ArrowUp": 38, "Backspace": 8, " ": 32}
OF_THE_MACHINE = ("software WebGL", "GL Driver Message")  # a browser without a graphics card says so


class Chromium(report_chromium.Browser):
    def __init__(self):
        super().__init__(find(), loopback=True)

    def reload(self):
        self.events.clear()
        self.call("Page.reload")

    def press(self, key, modifiers):
        """Presses and releases a key while the modifiers are held."""
        held = sum({"Alt": 1, "Control": 2, "Shift": 8}[one] for one in modifiers)
        code = KEYS.get(key, ord(key.upper()) if len(key) == 1 else 0)
        text = {"Enter": "\r", "Tab": ""}.get(key, key if len(key) == 1 and not held else "")
        self.call("Input.dispatchKeyEvent", type="keyDown" if text else "rawKeyDown", key=key, code=key, modifiers=held,
                  windowsVirtualKeyCode=code, text=text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=key, modifiers=held, windowsVirtualKeyCode=code)

    def insert(self, text):
        """Puts a text where the focus is, as an input method does."""
        self.call("Input.insertText", text=text)

    @contextlib.contextmanager
    def without_webgl(self):
        script = self.call("Page.addScriptToEvaluateOnNewDocument", source="HTMLCanvasElement.prototype.getContext = () => null")
        try:
            yield
        finally:
            self.call("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])

    def complaints(self):
        return [one for one in super().complaints() if not any(word in one for word in OF_THE_MACHINE)]
