"""palpate run from outside: masking noise, and markers for other recorders.

Usage: run_noise_and_markers_test.py PALPATE FOLDER_OF_FAKE_LIBLSL
"""

import array
import csv
import ctypes.util
import json
import math
import os
import pathlib
import pty
import socket
import subprocess
import sys
import time
import unittest
import unittest.mock

from live_case import FEELING, PALPATE, PROTOCOL, Live
from terminal import Terminal

FAKE_LSL = sys.argv.pop(1)


class Noise(Live):
    NOISE = {"masking_noise": {"kind": "pink", "level_db": -24}}

    def setUp(self):
        super().setUp()
        done = subprocess.run([PALPATE, "run", self.protocol(**self.NOISE), "--db", self.db, "--participant", "P01",
                               "--device", "simulated", "--no-window", "--sound-device", "none such"],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
        if "built without" in done.stderr:
            self.skipTest("no ALSA")
        self.refusal = done

    def events(self):
        texts = [text for (text,) in self.sql("SELECT text FROM notes ORDER BY id")]
        return [json.loads(text) for text in texts if text.startswith('{"masking_noise"')]

    def test_without_a_sound_device_the_session_is_refused_before_it_starts(self):
        self.assertEqual(self.refusal.returncode, 1, self.refusal.stderr)
        self.assertIn("no sound from 'none such'", self.refusal.stderr)
        self.assertIn("--without-noise", self.refusal.stderr)
        self.assertIn("--sound-device", self.refusal.stderr)
        self.assertFalse(self.db.exists())

    def test_without_noise_runs_and_is_recorded(self):
        terminal = self.begin("--without-noise", "--sound-device", "none such", **self.NOISE)
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.events(), [{"masking_noise": "left out"}])

    def test_a_protocol_without_noise_needs_no_sound_device(self):
        terminal = self.begin("--sound-device", "none such")
        terminal.type("1")
        self.finish(terminal)
        self.assertEqual(self.events(), [])

    def test_noise_plays_in_trials_and_fades_out_for_pages(self):
        sound = self.dir / "sound.raw"
        terminal = self.begin("--sound-device", f"file:{sound},raw", breaks={"min_seconds": 1}, **self.NOISE)
        rate = 48000
        while sound.stat().st_size < 4 * 4 * rate:  # seconds of two channels of two bytes
            time.sleep(0.05)
        terminal.type("1")
        self.finish(terminal)
        left = array.array("h", sound.read_bytes())
        right = left[1::2]
        left = left[0::2]
        self.assertEqual(left, right)
        runs, start = [], 0  # of sound, in samples
        parts = [left[i:i + 480] for i in range(0, len(left), 480)]
        loud = [any(part) for part in parts] + [False]  # at the end all sound must have faded out
        for i in range(1, len(loud)):
            if loud[i] and not loud[i - 1]:
                start = i
            if loud[i - 1] and not loud[i]:
                runs.append((start * 480, i * 480))
        self.assertFalse(loud[0], "silence at first")
        self.assertEqual(len(runs), 2, "one for each block: the break is a page to read")
        first, last = runs[0]
        fade = int(0.2 * rate)
        steady = left[first + fade + 480:last - fade - 480]
        level = 10 * math.log10(sum(x * x for x in steady) / len(steady) / 32767 ** 2)
        self.assertAlmostEqual(level, -24, delta=0.5)
        largest = max(map(abs, steady))
        for edge in (left[first:first + 960], left[last - 960:last]):
            self.assertLess(max(map(abs, edge)), 0.05 * largest, "no click")
        on, off, again, end = self.events()
        self.assertEqual((on["masking_noise"], on["kind"], on["level_db"], on["device"], on["seed"]),
                         ("on", "pink", -24, f"file:{sound},raw", PROTOCOL["seed"]))
        self.assertEqual((off["masking_noise"], again["masking_noise"], end["masking_noise"]), ("off", "on", "off"))
        self.assertAlmostEqual(off["seconds"], (last - first) / rate - 0.2, delta=0.1)
        self.assertEqual(off["underruns"], 0)


class Marks(Live):
    def ports(self):
        """A UDP socket and the master's side of a serial port, and their names for --markers."""
        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.addCleanup(receiver.close)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(30)
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        return receiver, master, [f"udp:127.0.0.1:{receiver.getsockname()[1]}", f"serial:{os.ttyname(slave)}:115200"]

    def test_markers_reach_udp_and_serial_ports_despite_a_blocked_receiver(self):
        receiver, master, (udp, serial) = self.ports()
        nobody = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        nobody.bind(("127.0.0.1", 0))
        closed = nobody.getsockname()[1]
        nobody.close()
        terminal = self.begin("--markers", udp, "--markers", serial, "--markers", f"udp:127.0.0.1:{closed}",
                              repetitions=1, blocks_per_renderer=1)
        lines = []

        def until(kind):
            """The first contact is certain only if it was awaited: the hand strokes by itself."""
            while True:
                line = json.loads(receiver.recv(4096))
                if kind == line["marker"] or line["marker"] != "first_contact":
                    lines.append(line)
                if kind == line["marker"]:
                    return

        until("first_contact")
        terminal.type("1")
        until("response")
        terminal.wait_for(FEELING)
        terminal.type(":repeat\n")
        until("cut_off")
        self.finish(terminal, "2")
        until("response")
        kinds = [line["marker"] for line in lines]
        self.assertEqual(kinds, ["trial_start", "first_contact", "response", "trial_start", "cut_off", "trial_start",
                                 "response"])
        sent = os.read(master, 100)
        self.assertEqual(sent[:2] + sent[2:].replace(b"\2", b""), bytes([1, 2, 3, 1, 5, 1, 3]))
        self.check_against_the_first_row(*lines[:3])
        self.assertEqual(lines[-1]["attempt"], 2)
        for line in lines:
            self.assertGreaterEqual(line["sent_ns"], line["time_ns"])
        self.assertIn("markers were not taken", terminal.text)

    def check_against_the_first_row(self, start, contact, response):
        row = self.export()[0]
        self.assertEqual({key: response[key] for key in ("participant_id", "session", "block", "trial", "attempt",
                                                         "renderer", "shape", "response")},
                         {"participant_id": "P01", "session": 1, "block": 1, "trial": 1, "attempt": 1,
                          "renderer": "ray", "shape": row["shape"], "response": "ball"})
        self.assertAlmostEqual((response["time_ns"] - start["time_ns"]) / 1e9, float(row["response_time"]), 9)
        self.assertAlmostEqual((contact["time_ns"] - start["time_ns"]) / 1e9, float(row["first_contact_time"]), 9)
        self.assertEqual(row["before_contact"], "0")
        self.assertGreater(float(row["max_force"]), 0)

    def test_a_protocols_own_codes_and_every_second(self):
        receiver, master, where = self.ports()
        codes = {"trial_start": 10, "response:ball": 14, "sync": 99}
        terminal = self.begin("--sync", "--markers", where[0], "--markers", where[1], repetitions=1,
                              blocks_per_renderer=1, codes=codes)
        lines = []

        def until(kind, count):
            while sum(line["marker"] == kind for line in lines) < count:
                lines.append(json.loads(receiver.recv(4096)))

        until("sync", 3)
        terminal.type("1")  # ball
        until("response", 1)
        self.finish(terminal, "2")  # box: no code of its own
        receiver.settimeout(0.2)
        try:
            while True:
                lines.append(json.loads(receiver.recv(4096)))
        except TimeoutError:
            pass
        seconds = [line for line in lines if line["marker"] == "sync"]
        others = [(line["marker"], line["code"]) for line in lines
                  if line["marker"] not in ("sync", "first_contact")]
        self.assertEqual(others, [("trial_start", 10), ("response", 14), ("trial_start", 10), ("response", 3)])
        self.assertEqual({(line["code"], line["participant_id"], line["trial"]) for line in seconds}, {(99, None, 0)})
        for earlier, later in zip(seconds, seconds[1:]):
            self.assertGreater(later["time_ns"] - earlier["time_ns"], 0)
        # In step with the first one: late on a busy computer, but without drift.
        self.assertLess((seconds[-1]["time_ns"] - seconds[0]["time_ns"]) / 1e9 - (len(seconds) - 1), 5)
        self.assertEqual(list(os.read(master, 1000)), [line["code"] for line in lines])
        noted = [json.loads(text) for (text,) in self.sql("SELECT text FROM notes") if text.startswith('{"markers"')]
        self.assertEqual(noted, [{"markers": where, "codes": {
            "cut_off": 5, "first_contact": 2, "interval": 6, "response": 3, "response:ball": 14, "sync": 99,
            "time_out": 4, "trial_start": 10}, "sync": True}])

    def test_the_code_leaves_this_computer_only_on_request(self):
        other, listener = "10.98.7.6", self.dir / "listen.py"
        network = ("ip link add here type veth peer name there && ip addr add 10.98.7.1/24 dev here && "
                   "ip link set lo up && ip link set here up && ip link set there up && "
                   f"ip neigh add {other} lladdr 02:00:00:00:00:06 dev here")
        alone = ["unshare", "--map-root-user", "--net", "sh", "-c"]
        if subprocess.run([*alone, network], capture_output=True).returncode:
            self.skipTest("no network of one's own can be made here")
        listener.write_text("""
import os, socket, sys
runner, wire = os.getppid(), socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
wire.bind((sys.argv[1], 0))
wire.settimeout(0.2)
print("listening", flush=True)
while os.getppid() == runner:
    try:
        frame = wire.recv(4096)
    except TimeoutError:
        continue
    if b'{"marker"' in frame:
        open(sys.argv[2], "ab").write(frame[frame.index(b'{"marker"'):])
""")
        def heard(wire, host, code, *options):
            said = self.dir / f"heard-{code}"
            run = [PALPATE, "run", self.protocol(repetitions=1, blocks_per_renderer=1, texts={}), "--db", self.db,
                   "--participant", code, "--new-participant", "--device", "simulated", "--no-window", "--markers",
                   f"udp:{host}:4000", *options]
            listen = f"'{sys.executable}' '{listener}' {wire} '{said}' & sleep 1"
            terminal = Terminal([*alone, f'{network}; {listen}; exec "$@"', "sh", *run])
            self.addCleanup(terminal.__exit__)
            terminal.wait_for("listening")
            terminal.wait_for(FEELING)
            terminal.type("1")
            self.finish(terminal)
            return {json.loads(line)["participant_id"] for line in said.read_text().splitlines()}

        self.assertEqual(heard("there", other, "CODEA"), {None})
        self.assertEqual(heard("there", other, "CODEB", "--marker-codes"), {"CODEB"})
        self.assertEqual(heard("lo", "10.98.7.1", "CODEC"), {"CODEC"})

    def test_lab_streaming_layer(self):
        said = self.dir / "lsl.txt"
        here = {"LD_LIBRARY_PATH": FAKE_LSL, "PALPATE_FAKE_LSL": str(said)}
        with unittest.mock.patch.dict(os.environ, here):
            terminal = self.begin("--markers", "lsl:touch", repetitions=1, blocks_per_renderer=1)
        terminal.type("1")
        self.finish(terminal)
        stream, *samples, outlet, info = said.read_text().splitlines()
        self.assertEqual(stream, "stream touch Markers 1 0 3 palpate-touch")
        self.assertEqual((outlet, info), ("outlet gone", "info gone"))
        kinds = []
        for sample in samples:
            at, text = sample.split(" ", 1)
            marker = json.loads(text)
            kinds.append(marker["marker"])
            self.assertIsNone(marker["participant_id"], "whoever is on the network may listen")
            self.assertAlmostEqual(float(at), marker["time_ns"] / 1e9, delta=0.05)
        self.assertEqual([kind for kind in kinds if kind != "first_contact"], ["trial_start", "response"] * 2)

    def stream(self, *options, **environment):
        """A session with samples, streamed. \return its terminal and the lines that the stream got"""
        said = self.dir / "lsl.txt"
        here = {"LD_LIBRARY_PATH": FAKE_LSL, "PALPATE_FAKE_LSL": str(said)} | environment
        with unittest.mock.patch.dict(os.environ, here):
            terminal = self.begin("--stream", "lsl:touch", *options, repetitions=1, blocks_per_renderer=1, samples=True)
        while "--markers" in options and "first_contact" not in said.read_text():
            time.sleep(0.05)
        terminal.type("1")
        self.finish(terminal)
        return terminal, pathlib.Path(f"{said}.samples").read_text().splitlines()

    def stored(self):
        """Of each trial, its samples as they are exported: rounded to 1 nm and 1 uN."""
        out = self.dir / "dataset"
        subprocess.run([PALPATE, "export", "--db", self.db, "--format", "psych-ds", "--out", out], check=True,
                       capture_output=True)
        table, = out.glob("data/*/*_description-haptic_data.csv")
        trials = {}
        with open(table, newline="", encoding="utf-8") as rows:
            for row in csv.DictReader(rows):
                trials.setdefault(row["trial"], []).append(row)
        return list(trials.values())

    def test_the_stream_of_samples_equals_the_stored_ones(self):
        terminal, (head, *lines, outlet, info) = self.stream("--markers", "lsl:events")
        self.assertEqual(head, "stream touch Haptics 20 100 2 palpate-touch")
        self.assertEqual((outlet, info), ("outlet gone", "info gone"))
        self.assertNotIn("not taken by the stream", terminal.text)
        vectors = {"tip": "m", "tail": "m", "force": "N", "torque": "N m", "device1": "N", "device2": "N"}
        channels = [(f"{name}_{axis}", unit) for name, unit in vectors.items() for axis in "xyz"]
        channels += [("depth", "m"), ("contacts", "1")]
        description = lines[:1 + 4 * len(channels)]
        self.assertEqual(description[0], "<channels>")
        self.assertEqual([tuple(description[i:i + 3]) for i in range(1, len(description), 4)],
                         [("<channel>", f"label={label}", f"unit={unit}") for label, unit in channels])
        rows, times, expected = [], [], 0
        for line in lines[len(description):]:
            if line.startswith("chunk "):
                self.assertEqual(expected, 0, "a chunk has as many rows as it says")
                expected = int(line.split()[1])
                continue
            expected -= 1
            at, *values = map(float, line.split())
            times.append(at)
            rows.append(values)
        self.assertEqual(times, sorted(times))
        decimals = [9] * 6 + [6] * 12 + [9, 0]
        streamed = [tuple(round(value, places) for value, places in zip(row, decimals)) for row in rows]
        markers = [line.split(" ", 1)[1] for line in (self.dir / "lsl.txt").read_text().splitlines() if "{" in line]
        starts = [marker["time_ns"] / 1e9 for marker in map(json.loads, markers) if marker["marker"] == "trial_start"]
        for trial, start in zip(self.stored(), starts, strict=True):
            kept = [tuple(float(row[label]) for label, _ in channels) for row in trial]
            # The stylus rests at first: its poses alone do not show where the trial begins.
            first = min(range(len(times)), key=lambda i: abs(times[i] - start))
            self.assertAlmostEqual(times[first], start, delta=0.001)  # one clock for both streams
            self.assertEqual(streamed[first:first + len(kept)], kept)
            for i in range(1, len(kept)):
                self.assertAlmostEqual(times[first + i] - times[first + i - 1], float(trial[i]["period"]), delta=0.001)
        self.assertEqual(len(starts), 2)
        self.assertTrue(any(any(row[6:9]) for row in streamed), "the first trial was felt up to a contact")

    def test_refused_samples_of_the_stream_are_counted_without_delay(self):
        terminal, lines = self.stream(PALPATE_FAKE_LSL_REFUSES="1")
        self.assertNotIn("chunk", " ".join(lines))
        self.assertRegex(terminal.text, r"[1-9]\d* samples were not taken by the stream")
        self.assertEqual(len(self.stored()), 2)

    def test_an_impossible_stream_is_reported_first(self):
        faults = [("udp:x:1", 2, "expected lsl or lsl:NAME"), ("lsl:", 2, "expected lsl or lsl:NAME")]
        if ctypes.util.find_library("lsl") is None:
            faults.append(("lsl:x", 1, "liblsl is not installed"))
        for where, status, words in faults:
            with self.run_session("--stream", where) as terminal:
                self.assertEqual(terminal.finish(), status)
                self.assertIn(words, terminal.text)
        with self.run_session("--sync") as terminal:
            self.assertEqual(terminal.finish(), 2)
            self.assertIn("--markers", terminal.text)
        self.assertFalse(self.db.exists())

    def test_outputs_that_cannot_be_opened_are_reported_first(self):
        for where in ("serial:/dev/null", "serial:" + str(self.dir / "none"), "udp:no.such.host.invalid:9"):
            with self.run_session("--markers", where) as terminal:
                self.assertEqual(terminal.finish(), 1)
                self.assertIn("markers to", terminal.text)
        self.assertFalse(self.db.exists())


if __name__ == "__main__":
    unittest.main()
