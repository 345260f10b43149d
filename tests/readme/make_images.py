"""Makes the pictures of .github/images/: a live session on a display in memory, and figures of a simulated study.

Usage: make_images.py PALPATE [NAME ...]    all pictures, or those of these names
       make_images.py --list                their names

Needs Xvfb, xdotool and ImageMagick, for design Chromium, and for live-session a machine that is not busy. The figures are those of the
study that runner/quickstart.sh simulates: the same ones wherever they are made.
"""

import json
import os
import pathlib
import shlex
import shutil
import sqlite3
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
IMAGES = ROOT / ".github" / "images"
PROTOCOLS = ROOT / "protocols"
sys.path.insert(0, str(ROOT / "tests" / "runner" / "display"))
sys.path.insert(0, str(ROOT / "tests" / "analysis" / "report"))

from contact_patches import contact_patches  # noqa: E402
from virtual_screen import VirtualScreen, wait_for  # noqa: E402

KEYS = {"sphere": "1", "cone": "2", "cylinder": "3", "cube": "4"}


class Disturbed(Exception):
    """A busy machine made the servo miss ticks, which the console would show."""


class LiveSession:
    """`palpate run protocols/quick.json --device mouse`, answered and felt with an emulated hand."""

    def __init__(self, palpate, folder):
        # Of its own: a session that was disturbed leaves files beside its database.
        self.database = pathlib.Path(tempfile.mkdtemp(dir=folder)) / "try.db"
        self.screen = VirtualScreen("1600x900")  # one monitor: both windows side by side
        self.program = subprocess.Popen(
            [palpate, "run", PROTOCOLS / "quick.json", "--db", self.database, "--participant", "T1", "--new-participant",
             "--number", "2", "--device", "mouse"], env=self.screen.environment, stderr=subprocess.DEVNULL)
        self.participant = self.screen.window("quick, T1")
        self.console = self.screen.window("quick, T1 - console")
        time.sleep(2)  # drawn

    def close(self):
        self.program.kill()
        self.program.wait()
        self.screen.close()

    def rows(self, query):
        try:
            with sqlite3.connect(f"file:{self.database}?mode=ro", uri=True, timeout=20) as connection:
                return connection.execute(query).fetchall()
        except sqlite3.OperationalError:  # not there yet
            return []

    def done(self):
        return self.rows("SELECT count(*) FROM attempts WHERE state = 'completed'")[0][0]

    def check(self):
        if reasons := self.rows("SELECT cut_off_reason FROM attempts WHERE state = 'cut_off'"):
            raise Disturbed(reasons[0][0])
        return True

    def end(self):
        """Returns the ticks that the servo has missed."""
        self.program.terminate()
        self.program.wait()
        notes = [json.loads(text) for (text,) in self.rows("SELECT text FROM notes") if text.startswith("{")]
        return next(note["servo"]["missed_ticks"] for note in notes if "servo" in note)

    def wait_for_trial(self):
        wait_for("a trial", lambda: self.check() and self.rows("SELECT 1 FROM attempts WHERE state = 'running'"))
        time.sleep(1.5)  # the stylus rests, and the forces come on

    def begin(self):
        self.screen.focus(self.participant)
        while not self.rows("SELECT 1 FROM attempts"):
            self.screen.key("space")
            time.sleep(0.5)

    def point(self, across, down):
        """Shares of the console, where its view is."""
        width, height = self.screen.size(self.console)
        self.screen.point(self.console, int(across * width), int(down * height))

    def feel(self, seconds):
        """The tip goes over the object in the middle of the view, from left to right and back."""
        end, step = time.monotonic() + seconds, 0
        while time.monotonic() < end:
            self.point(0.29 + 0.003 * abs(8 - step % 16), 0.345 + 0.002 * (step % 12))
            time.sleep(0.08)
            step += 1

    def answer(self, wrong=False):
        before = self.done()
        shape = self.rows("SELECT shape FROM attempts ORDER BY id DESC LIMIT 1")[0][0]
        key = KEYS["cube" if wrong and shape != "cube" else "cone" if wrong else shape]
        while self.check() and self.done() == before:
            self.screen.focus(self.participant)
            self.screen.key(key)
            time.sleep(0.5)


def live_session(palpate, folder):
    session = LiveSession(palpate, folder)
    try:
        session.begin()
        for trial in range(5):  # few: even an idle virtual machine stops for some ms twice a minute
            session.wait_for_trial()
            session.feel(1 + 0.4 * (trial * 7 % 5))
            session.answer(wrong=trial == 3)
            session.point(0.06, 0.5)
        session.wait_for_trial()
        session.feel(4)
        session.check()
        # Few colours: letters, lines and one shaded object.
        picture = folder / "live-session.png"
        subprocess.run(["import", "-silent", "-window", "root", "-trim", "+repage", "-colors", "255", "-strip",
                        f"PNG8:{picture}"], env=session.screen.environment, check=True)
        if missed := session.end():
            raise Disturbed(f"{missed} ticks were missed")
        shutil.copyfile(picture, IMAGES / picture.name)
    finally:
        session.close()


def undisturbed(what, *arguments):
    for _ in range(20):
        try:
            return what(*arguments)
        except Disturbed as reason:
            print(f"once more: {reason}", file=sys.stderr)
    raise SystemExit("this machine is too busy for a session at 1 kHz")


def simulated_study(palpate, folder):
    """The paper's study, once."""
    database = folder / "study.db"
    if not database.exists():
        subprocess.run([palpate, "simulate", PROTOCOLS / "ho2000.json", "--db", database], check=True)
        subprocess.run([palpate, "analyze", "--db", database, "--figures", folder], stdout=subprocess.DEVNULL,
                       check=True)
    return database


def figure(name):
    def make(palpate, folder):
        simulated_study(palpate, folder)
        shutil.copyfile(folder / f"{name}.svg", IMAGES / f"{name}.svg")
    return make


def power(palpate, folder):
    subprocess.run([palpate, "plan", "--db", simulated_study(palpate, folder), "--effect", "cone=22,cube=11", "--studies", "1000",
                    "--figure", IMAGES / "power.svg", "--force"], stdout=subprocess.DEVNULL, check=True)


def group(palpate, folder):
    """JNDs and PSEs of eight simulated participants with both renderers."""
    database, both = folder / "tasks.db", folder / "both.json"
    protocol = json.loads((PROTOCOLS / "stiffness-2afc.json").read_text())
    protocol["renderers"] = ["point", "ray"]
    both.write_text(json.dumps(protocol))
    subprocess.run([palpate, "simulate", both, "--db", database, "--participants", "8"], check=True)
    subprocess.run([palpate, "analyze", "--db", database, "--figures", folder / "tasks"], stdout=subprocess.DEVNULL, check=True)
    shutil.copyfile(folder / "tasks" / "group1.svg", IMAGES / "group.svg")


def study_figure(protocol, name):
    """A figure of three simulated participants, as protocols/README.md has them simulated and analysed."""
    def make(palpate, folder):
        database, figures = folder / f"{protocol}.db", folder / protocol
        subprocess.run([palpate, "simulate", PROTOCOLS / f"{protocol}.json", "--db", database, "--participants", "3", "--seed", "1"], check=True)
        subprocess.run([palpate, "analyze", "--db", database, "--figures", figures], stdout=subprocess.DEVNULL, check=True)
        shutil.copyfile(figures / f"{name}.svg", IMAGES / f"{protocol}.svg")
    return make


def cues_pse(palpate, folder):
    """Points of equality of the study of seen and felt sizes in protocols/README.md."""
    database = folder / "size.db"
    subprocess.run([palpate, "simulate", PROTOCOLS / "visual-haptic-size.json", "--db", database, "--participants", "12", "--seed", "1"], check=True)
    subprocess.run([palpate, "analyze", "--db", database, "--cues", "--figures", folder / "cues"], stdout=subprocess.DEVNULL, check=True)
    shutil.copyfile(folder / "cues" / "cues-pse.svg", IMAGES / "cues-pse.svg")


def sweep_gains(palpate, folder):
    """The sweep of runner/participants/README.md, which takes half an hour."""
    database = folder / "participants.sweep"
    subprocess.run([palpate, "sweep", PROTOCOLS / "ho2000.json", "--space", PROTOCOLS / "spaces" / "participants.json",
                    "--points", "2000", "--design", "lhs", "--seed", "1", "--participants", "2", "--repetitions", "20",
                    "--participant-version", "3", "--jobs", str(os.cpu_count()), "--db", database], check=True)
    subprocess.run([palpate, "analyze", "--sweep", database, "--figures", folder / "sweep"], stdout=subprocess.DEVNULL, check=True)
    shutil.copyfile(folder / "sweep" / "gains.svg", IMAGES / "sweep-gains.svg")


def soft_stability(palpate, folder):
    subprocess.run([palpate, "stability", "--soft", "--figure", IMAGES / "soft-stability.svg", "--force"], stdout=subprocess.DEVNULL,
                   check=True)


def example(name):
    """By the Python module of the same build, which takes minutes."""
    def make(palpate, folder):
        module = pathlib.Path(palpate).parent / "python"
        subprocess.run(["/usr/bin/python3", ROOT / f"runner/python/examples/{name}.py", "--figure",
                        folder / f"{name}.png"], env={**os.environ, "PYTHONPATH": str(module)}, check=True)
        shutil.copyfile(folder / f"{name}.png", IMAGES / f"{name.replace('_', '-')}.png")
    return make


def scene(name):
    """The second picture of a path of protocols/scenes, as rendering/README.md has it drawn."""
    def make(palpate, folder):
        page = (ROOT / "rendering" / "README.md").read_text().replace("\\\n", " ")
        command = next(line for line in page.splitlines() if line.startswith(f"palpate explore protocols/scenes/{name}.json"))
        subprocess.run([palpate, *shlex.split(command)[1:], "--frames", folder / name], cwd=ROOT, stdout=subprocess.DEVNULL, check=True)
        subprocess.run(["convert", folder / name / "frame-00001.png", "-strip", "-define", "png:compression-level=9",
                        IMAGES / f"{name}.png"], check=True)
    return make


def explore_window(palpate, folder):
    """A recorded path in the middle of its contact, paused."""
    scene = PROTOCOLS / "scenes" / "fig13-two-objects.json"
    screen = VirtualScreen("1200x760")
    program = subprocess.Popen([palpate, "explore", scene, "--trajectory", scene.with_suffix(".csv")], env=screen.environment)
    try:
        window = screen.window("fig13-two-objects.json - palpate explore")
        time.sleep(2)
        screen.click(window, 340, 730)  # a moment of the force plot
        time.sleep(2)
        screen.settled_picture(window)
        subprocess.run(["import", "-silent", "-window", "root", "-colors", "255", "-strip", f"PNG8:{IMAGES / 'explore-window.png'}"],
                       env=screen.environment, check=True)
    finally:
        program.kill()
        program.wait()
        screen.close()


def design(palpate, folder):
    """The page of palpate design on the cone of the paper's study."""
    from report_chromium import Browser, find  # only this picture needs a browser
    shutil.copy(PROTOCOLS / "ho2000.json", folder)
    program = subprocess.Popen([palpate, "design", folder / "ho2000.json", "--no-browser"], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True)
    browser = Browser(find(), loopback=True)
    try:
        browser.window(1280, 800)
        browser.open_url(program.stdout.readline().strip())
        wait_for("the check", lambda: browser.run("window.design !== undefined && design.checks.is_settled"))
        browser.run("design.views.get('stimuli').view.go_to(1)")
        time.sleep(0.5)  # drawn
        (folder / "page.png").write_bytes(browser.screenshot(whole=False))
        subprocess.run(["convert", folder / "page.png", "+dither", "-colors", "255", "-strip", f"PNG8:{IMAGES / 'design.png'}"], check=True)
    finally:
        browser.close()
        program.kill()
        program.wait()


SCENES = ["fig3b-extended-probe", "fig13-two-objects", "fig14-dumbbells", "fig16-rocket", "fig17a-engine", "fig17b-instrument", "layers"]
STUDIES = {"force-field": "reach2", "grating-roughness": "magnitude1", "spacing-2afc": "function1", "tap-hardness": "function1"}
PICTURES = {"design": design, **{name: scene(name) for name in SCENES}, **{name: study_figure(name, figure) for name, figure in STUDIES.items()},
            "contact-patches": lambda palpate, folder: (IMAGES / "contact-patches.svg").write_text(contact_patches()),
            "explore-window": explore_window, "live-session": lambda *arguments: undisturbed(live_session, *arguments), "figure15": figure("figure15"),
            "speedup": figure("speedup"), "power": power, "group": group, "cues-pse": cues_pse, "sweep-gains": sweep_gains, "soft-stability": soft_stability,
            "recover-parameters": example("recover_parameters"), "choose-sizes": example("choose_sizes")}


def main(arguments):
    if arguments == ["--list"]:
        print("\n".join(PICTURES))
        return
    palpate, *names = arguments
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for name in names or PICTURES:
            PICTURES[name](str(pathlib.Path(palpate).resolve()), pathlib.Path(scratch))


if __name__ == "__main__":
    main(sys.argv[1:])
