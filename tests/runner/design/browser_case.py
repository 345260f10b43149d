"""The page of palpate design in a headless browser, driven by its keyboard and mouse.

A third argument, chromium or firefox, chooses the browser.
"""

import sys
import time

import chromium
import firefox
from design_case import PATIENCE, PROTOCOLS, DesignCase  # noqa: F401

BROWSERS = {"chromium": chromium, "firefox": firefox}
NAME = sys.argv.pop(1) if sys.argv[1:2] and sys.argv[1] in BROWSERS else "chromium"


class BrowserCase(DesignCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = chromium.Chromium() if NAME == "chromium" else firefox.Firefox()

    @classmethod
    def tearDownClass(cls):
        cls.browser.close()

    def page(self, path, checked=True):
        """Opens the page of a file and waits for its first check."""
        process = self.design(path)
        self.browser.window(1280, 900)
        self.browser.open_url(self.address)
        if checked:
            self.checked()
        return process

    def js(self, script):
        return self.browser.run(script)

    def wait_for(self, script):
        end = time.monotonic() + PATIENCE
        while not (found := self.js(script)):
            self.assertLess(time.monotonic(), end, script)
            time.sleep(0.02)
        return found

    def checked(self):
        """Waits until the page shows what the program says of its text."""
        self.wait_for("window.design !== undefined && design.checks.is_settled")

    def text(self):
        return self.js("design.document.text")

    def set_text(self, text):
        """As if it was typed into the text's view."""
        self.js("design.go('text'); design.views.get('text').view.area.focus(); design.views.get('text').view.area.select();")
        self.browser.insert(text)

    def key(self, key, *modifiers):
        self.browser.press(key, modifiers)

    def type(self, text):
        self.browser.insert(text)

    def focused(self):
        return self.js("(e => e.getAttribute('aria-label') || e.labels?.[0]?.textContent || e.textContent)(document.activeElement)")

    def tab_to(self, name, *modifiers):
        """Presses Tab until the control of this name has the focus."""
        seen = []
        for _ in range(200):
            self.key("Tab", *modifiers)
            seen.append(self.focused().strip())
            if seen[-1].startswith(name):
                return
        self.fail(f"no Tab leads to {name!r}: {seen[:60]}")

    def needs_modules(self):
        """Leaves out a test of the page's functions themselves, which are the same in each browser."""
        if NAME == "firefox":
            self.skipTest("Firefox imports nothing for a script from outside")

    def complaints(self):
        return self.browser.complaints()

    def foreign_requests(self):
        return [url for url in self.browser.requests() if not url.startswith(f"http://127.0.0.1:{self.port}/")]

    def overlaps(self):
        """Panels and controls that cover each other, and whether the page scrolls sideways."""
        return self.js("""(() => {
          const out = [];
          const shown = [...document.querySelectorAll('header > *, nav button, #work > *, aside > section, main .card, main button, main input, main select, main label')]
              .filter(e => e.offsetParent && e.getClientRects().length && !e.closest('[hidden], .scroll, .text'));
          for (let i = 0; i < shown.length; ++i)
            for (let j = i + 1; j < shown.length; ++j) {
              if (shown[i].contains(shown[j]) || shown[j].contains(shown[i])) continue;
              const a = shown[i].getBoundingClientRect(), b = shown[j].getBoundingClientRect();
              const x = Math.min(a.right, b.right) - Math.max(a.left, b.left), y = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
              const sticks = [shown[i], shown[j]].some(e => e.closest('header, nav'));
              if (x > 1 && y > 1 && !(sticks && scrollY > 0)) out.push([shown[i].outerHTML.slice(0, 80), shown[j].outerHTML.slice(0, 80), x, y]);
            }
          if (document.documentElement.scrollWidth > innerWidth) out.push('scrolls sideways');
          return out;
        })()""")


def skip_without_browser():
    """ctest counts this status as skipped."""
    if BROWSERS[NAME].find() is None:
        print(f"no {NAME}", file=sys.stderr)
        sys.exit(77)
