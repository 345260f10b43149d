"""A display in memory, with keyboard, pointer and a camera: Xvfb, xdotool, ImageMagick. With several monitors: Xorg with its
driver for no graphics card (dummy), xrandr."""

import ctypes
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

PATIENCE = 60  # s; only a hang takes so long

PER_FRAME = 0.5  # s, more than drawing a frame takes on a busy machine without a graphics card

NEEDED = ["Xvfb", "xdotool", "import"]


def skip_without_screen():
    missing = [tool for tool in NEEDED if shutil.which(tool) is None]
    if missing:
        raise unittest.SkipTest("not installed: " + ", ".join(missing))


def wait_for(what, condition):
    """The first result of condition() that is true."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        result = condition()
        if result:
            return result
        time.sleep(0.05)
    raise AssertionError(f"waited {PATIENCE} s in vain for {what}")


class VirtualScreen:
    next_number = 1000 + 100 * (os.getpid() % 10000)

    def __init__(self, size="1600x1000", *options):
        """Options are the X server's own."""
        self.options = options
        # Use a number of this process's own. If the server chooses, it may take a number that another test's server has
        # just released, and that one then removes the common socket as it ends.
        for number in range(self.next_number, self.next_number + 20):
            if self.start(number, size):
                break
        else:
            raise AssertionError("Xvfb did not start")
        VirtualScreen.next_number = number + 1
        self.name = f":{number}"
        self.manager = None
        # One thread of software drawing: the tests share their machine with a servo.
        self.environment = dict(os.environ, DISPLAY=self.name, LP_NUM_THREADS="1")
        # Graphics drivers keep memory until the end, even more after their display has died.
        options = os.environ.get("ASAN_OPTIONS", "")
        self.environment["ASAN_OPTIONS"] = (options + ":" if options else "") + "detect_leaks=0"

    def start(self, number, size):
        """False: the number is in use."""
        reading, writing = os.pipe()
        self.server = subprocess.Popen([*self.server_of(size), f":{number}", "-displayfd", str(writing), "-nolisten", "tcp", *self.options],
                                       pass_fds=[writing], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(writing)
        with os.fdopen(reading) as pipe:
            ready = pipe.readline().strip() == str(number)
        if not ready:
            self.server.wait()
        return ready

    def server_of(self, size):
        return ["Xvfb", "-screen", "0", size + "x24"]

    def close(self):
        if self.manager:
            self.stop_manager()
        if self.server.poll() is None:
            self.server.send_signal(signal.SIGCONT)
            self.server.terminate()
        self.server.wait()

    def manage(self, manager):
        """Starts a window manager."""
        command = {"openbox": ["openbox"], "xfwm4": ["dbus-run-session", "--", "xfwm4", "--compositor=off"]}[manager]
        home = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)  # for its files
        self.manager = home, subprocess.Popen(
            command, env=dict(self.environment, HOME=home.name, XDG_RUNTIME_DIR=home.name), start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for("the window manager", lambda: not subprocess.run(
            ["xdotool", "get_desktop"], env=self.environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE).stderr)

    def stop_manager(self, how=signal.SIGTERM):
        home, process = self.manager
        os.killpg(process.pid, how)
        process.wait()
        home.cleanup()
        self.manager = None

    def kill(self):
        self.server.kill()
        self.server.wait()

    def stall(self):
        self.server.send_signal(signal.SIGSTOP)

    def go_on(self):
        self.server.send_signal(signal.SIGCONT)

    def do(self, *words):
        done = subprocess.run(["xdotool", *map(str, words)], env=self.environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        return done.stdout

    def window(self, title):
        """The visible window whose whole title matches the regular expression."""
        return wait_for(f"a window '{title}'", lambda: self.do(
            "search", "--onlyvisible", "--name", f"^{title}$").split())[0]

    def key(self, *keys):
        self.do("key", "--clearmodifiers", *keys)

    def focus(self, window):
        self.do("windowfocus", window)
        wait_for("the keyboard", lambda: self.do("getwindowfocus").strip() == window)

    def ask_to_close(self, window):
        """As the cross of a window's frame does; xdotool of Debian 12 can only destroy it."""
        x11 = ctypes.CDLL("libX11.so.6")
        for name in ("XOpenDisplay", "XInternAtom"):
            getattr(x11, name).restype = ctypes.c_void_p
        display = ctypes.c_void_p(x11.XOpenDisplay(self.environment["DISPLAY"].encode()))
        atom = lambda name: x11.XInternAtom(display, name, 0)

        class ClientMessage(ctypes.Structure):
            _fields_ = [("type", ctypes.c_int), ("serial", ctypes.c_ulong), ("send_event", ctypes.c_int),
                        ("display", ctypes.c_void_p), ("window", ctypes.c_ulong), ("message_type", ctypes.c_ulong),
                        ("format", ctypes.c_int), ("data", ctypes.c_long * 5), ("room", ctypes.c_long * 24)]
        message = ClientMessage(type=33, window=int(window), message_type=atom(b"WM_PROTOCOLS"), format=32)
        message.data[0] = atom(b"WM_DELETE_WINDOW")
        x11.XSendEvent(display, ctypes.c_ulong(int(window)), 0, ctypes.c_long(0), ctypes.byref(message))
        x11.XCloseDisplay(display)

    def size(self, window):
        words = dict(line.split("=") for line in self.do(
            "getwindowgeometry", "--shell", window).split())
        return int(words["WIDTH"]), int(words["HEIGHT"])

    def box(self, window):
        """Left, top, right and lower edge on the screen, without its frame. xdotool of Debian 12 counts the frame of
        a window manager twice."""
        x11 = ctypes.CDLL("libX11.so.6")
        x11.XOpenDisplay.restype = x11.XDefaultRootWindow.restype = ctypes.c_void_p
        display = ctypes.c_void_p(x11.XOpenDisplay(self.environment["DISPLAY"].encode()))
        root, child, own = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_ulong(int(window))
        x, y, width, height, border, depth = (ctypes.c_int() for _ in range(6))
        x11.XGetGeometry(display, own, *map(ctypes.byref, (root, x, y, width, height, border, depth)))
        x11.XTranslateCoordinates(display, own, root, 0, 0, *map(ctypes.byref, (x, y, child)))
        x11.XCloseDisplay(display)
        return x.value, y.value, x.value + width.value, y.value + height.value

    def point(self, window, x, y):
        self.do("mousemove", "--window", window, x, y)

    def click(self, window, x, y):
        self.point(window, x, y)
        for step in ("mousedown", "mouseup"):
            time.sleep(PER_FRAME)
            self.do(step, 1)
        time.sleep(PER_FRAME)

    def picture(self, window):
        """Its pixels as bytes."""
        return subprocess.run(["import", "-silent", "-window", window, "-depth", "8", "rgb:-"],
                              env=self.environment, check=True, stdout=subprocess.PIPE).stdout

    def pixels(self, window, x, y, width=1, height=1):
        """Red, green and blue of each."""
        seen = subprocess.run(
            ["import", "-silent", "-window", window, "-crop", f"{width}x{height}+{x}+{y}",
             "-depth", "8", "rgb:-"], env=self.environment, check=True, stdout=subprocess.PIPE).stdout
        return list(zip(seen[0::3], seen[1::3], seen[2::3]))

    def keep(self, window, name):
        """Keeps a picture for inspection: PALPATE_PICTURES names a folder."""
        folder = os.environ.get("PALPATE_PICTURES")
        if folder:
            subprocess.run(["import", "-silent", "-window", window, f"{folder}/{name}.png"],
                           env=self.environment, check=True)

    def settled_picture(self, window, differs_from=None):
        """Waits for two equal pictures in a row that differ from the earlier one."""
        def pair():
            first = self.picture(window)
            time.sleep(0.1)
            return first if first == self.picture(window) and first != differs_from else None
        return wait_for("a picture that stands still", pair)


XORG = """
Section "Device"
  Identifier "card"
  Driver "dummy"
  VideoRam 256000
EndSection
Section "Monitor"
  Identifier "monitor"
  HorizSync 5.0 - 1000.0
  VertRefresh 5.0 - 200.0
EndSection
Section "Screen"
  Identifier "screen"
  Device "card"
  Monitor "monitor"
  DefaultDepth 24
EndSection
Section "ServerFlags"
  Option "AutoAddDevices" "false"
EndSection
"""


class MonitorScreen(VirtualScreen):
    """Two monitors, DUMMY0 and DUMMY1; nothing is on them until place()."""

    def __init__(self):
        missing = [tool for tool in ("Xorg", "xrandr") if shutil.which(tool) is None]
        if not pathlib.Path("/usr/lib/xorg/modules/drivers/dummy_drv.so").exists():
            missing.append("xserver-xorg-video-dummy")
        if missing:
            raise unittest.SkipTest("not installed: " + ", ".join(missing))
        self.folder = tempfile.TemporaryDirectory()
        super().__init__("", "-noreset", "+extension", "GLX")

    def server_of(self, size):
        folder = pathlib.Path(self.folder.name)
        (folder / "xorg.conf").write_text(XORG)
        return ["/usr/lib/xorg/Xorg", "-config", str(folder / "xorg.conf"), "-logfile", str(folder / "log")]

    def close(self):
        super().close()
        self.folder.cleanup()

    def place(self, *monitors, primary=0):
        """Each as "1280x800+0+0"; None: switched off."""
        words = []
        for number, monitor in enumerate(monitors):
            words += ["--output", f"DUMMY{number}"]
            if monitor is None:
                words.append("--off")
                continue
            size, left, top = monitor.split("+")
            subprocess.run(["xrandr", "--addmode", f"DUMMY{number}", size], env=self.environment, stderr=subprocess.DEVNULL)
            words += ["--mode", size, "--pos", f"{left}x{top}"] + (["--primary"] if number == primary else [])
        subprocess.run(["xrandr", *words], env=self.environment, check=True)
