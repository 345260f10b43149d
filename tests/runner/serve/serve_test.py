"""palpate serve on the simulated device, from outside: admission, messages, and the ends of forces.

Usage: serve_test.py PALPATE PROTOCOLS CLIENT.py
"""

import asyncio
import contextlib
import csv
import json
import os
import pathlib
import signal
import socket
import stat
import subprocess
import sys
import threading
import time
import unittest

import jsonschema
from serve_case import BALL, PALPATE, PATIENCE, PROTOCOLS, Client, ServeCase, ServeError, client

GOOD = ['{"id":1,"type":"alive"}', '{"id":2,"type":"clock","t_client":1.5}', '{"id":3,"type":"mark","code":255}',
        '{"id":4,"type":"subscribe","rate_hz":0.5,"fields":["depth"]}', '{"id":5,"type":"clear"}',
        '{"id":6,"type":"load","scene":' + json.dumps(BALL) + '}', '{"id":7,"type":"note","text":"h\u00e4nd"}',
        '{"id":8,"type":"start","renderer":"point","trial":3}', '{"id":9,"type":"stop","reason":"x"}',
        '{"id":10,"type":"set","path":"/objects/0/damping_ns_per_m","value":0}',
        '{"id":9007199254740992,"type":"emergency"}', '{"id":1.2e1,"type":"alive"}',
        '{"id":13,"type":"note","text":"' + "\u00e9" * 1000 + '"}',
        '{"id":14,"type":"clock","t_client":1.5,"t_seen_ns":9223372036854775807}',
        '{"id":15,"type":"subscribe","rate_hz":1e-300,"fields":[]}']
BAD = ['{"id":1,"type":"jump"}', '{"type":"alive"}', '{"id":-1,"type":"alive"}', '{"id":1.5,"type":"alive"}',
       '{"id":1,"type":"alive","more":0}', '{"id":1,"type":"mark","code":256}', '{"id":1,"type":"mark"}',
       '{"id":1,"type":"subscribe","rate_hz":1001}', '{"id":1,"type":"subscribe","rate_hz":1,"fields":["tip","tip"]}',
       '{"id":1,"type":"subscribe","rate_hz":1,"fields":["smell"]}', '{"id":1,"type":"start","renderer":"line"}',
       '{"id":1,"type":"start","trial":0}', '{"id":1,"type":"set","path":"/gravity","value":1}',
       '{"id":1,"type":"note"}', '{"id":1,"type":"answer","response":3}', '{"id":1,"type":"load","scene":[]}',
       '{"id":"1","type":"alive"}',
       '{"id":1,"type":"clock","t_client":"now"}', '[]', '3', 'null',
       '{"id":1e300,"type":"alive"}', '{"id":9007199254740993,"type":"alive"}', '{"id":1,"type":"mark","code":1.5}',
       '{"id":1,"type":"note","text":"' + "\u00e9" * 1001 + '"}', '{"id":1,"type":"clock","t_seen_ns":-1}',
       '{"id":1,"type":"clock","t_seen_ns":123456789012345678901234567890}']
NO_JSON = ['', '{', '{"id":1,"type":"alive"', "{'id':1}", '{"id":1,"id":2,"type":"alive"}', '\xff', '[' * 5000,
           '{"id":NaN,"type":"alive"}', '{"id":1,"type":"note","text":"\\ud800"}', '{"id":1e400,"type":"alive"}',
           '{"id":1,"type":"load","scene":' + '{"objects":' * 300 + '1' + '}' * 301]

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "session"))
from terminal import Terminal  # noqa: E402


def schemas():
    """Schemas of a client's messages and of the server's."""
    scene = (PROTOCOLS / "scene.schema.json").read_text().replace('"#/$defs/', '"#/$defs/scene/$defs/')
    whole = json.loads((PROTOCOLS / "serve.schema.json").read_text().replace('"scene.schema.json"', '"#/$defs/scene"'))
    whole["$defs"]["scene"] = json.loads(scene)
    for schema in (whole, whole["$defs"]["scene"]):  # for a validator without files
        schema.pop("$id", None)
    jsonschema.Draft202012Validator.check_schema(whole)
    return (jsonschema.Draft202012Validator(whole),
            jsonschema.Draft202012Validator({"$ref": "#/$defs/server", "$defs": whole["$defs"]}))


class Serve(ServeCase):
    def lines(self):
        """A connection of the Unix socket that sends and receives raw lines."""
        link = client._Lines(str(self.path), PATIENCE)
        link.socket.settimeout(PATIENCE)
        self.addCleanup(link.socket.close)
        return link

    def hears(self, link):
        while True:
            said = json.loads(link.receive())
            if "re" in said:
                return said

    def hello(self, link, **more):
        link.send(json.dumps({"id": 0, "type": "hello", "token": self.said["token"], "version": 1, **more}))
        return self.hears(link)

    def http(self, *headers):
        """The status of a request of the loopback, and the rest of the answer."""
        port = int(self.said["url"].rsplit(":", 1)[1])
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as link:
            link.sendall("\r\n".join(["GET / HTTP/1.1", *headers, "", ""]).encode())
            got = b""
            while b"\r\n\r\n" not in got:
                try:
                    more = link.recv(4096)
                except ConnectionResetError:
                    more = b""
                if not more:
                    break
                got += more
        return int(got.split()[1]) if got else None

    def test_a_trial(self):
        self.serve()
        with self.client() as hand:
            self.assertEqual(hand.server["scene"], BALL)
            zero, contact = self.touch(hand, renderer="ray", trial=7)
            self.assertEqual(contact["object"], 0)
            hand.wait_for("left", PATIENCE)
            trial = hand.answer("ball")
            self.assertEqual((trial["trial"], trial["response"], trial["zero_t_ns"]), (7, "ball", zero))
            self.assertAlmostEqual(trial["response_time_s"], (trial["t_ns"] - zero) * 1e-9)
            self.assertAlmostEqual(trial["first_contact_s"], (contact["t_ns"] - zero) * 1e-9)
            self.assertGreater(trial["response_time_s"], trial["first_contact_s"])
            self.assertGreater(trial["max_force_n"], 0)
            self.refused("nothing-felt", hand.answer, "ball")
            self.refused("bad-message", hand.ask, "start", renderer="line")
            hand.clear()  # ticks may have been missed
            hand.start()
            self.refused("running", hand.start)
            self.refused("running", hand.load, BALL)
            self.assertGreater(hand.stop()["ticks"], 0)

    def test_forces_along_the_path_equal_those_of_render(self):
        self.serve()
        with self.client() as hand:
            hand.subscribe(1000, ("tip", "tail", "rendered", "contact", "depth", "faults"))
            for renderer in ("ray", "point"):
                hand.clear()
                hand.start(renderer=renderer)
                hand.wait_for("left", PATIENCE)
                hand.stop()
                hand.ask("alive")
                time.sleep(0.1)
                got = hand.samples()
                self.assertEqual(hand.dropped, 0)
                count = len(got["tick"])
                self.assertEqual(list(got["tick"]), list(range(count)))
                path, out = self.dir / f"{renderer}.csv", self.dir / f"{renderer}-forces.csv"
                with path.open("w") as file:
                    file.write("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n")
                    for t, tip, tail in zip(got["t_ns"], got["tip"], got["tail"]):
                        file.write(",".join(map(repr, [float(t - got["t_ns"][0]) * 1e-9, *map(float, tip), *map(float, tail)])) + "\n")
                subprocess.run([PALPATE, "render", "--scene", self.scene, "--renderer", renderer, "--trajectory", path,
                                "--out", out], check=True, capture_output=True)
                rows = list(csv.DictReader(out.read_text().splitlines()))
                self.assertEqual(len(rows), count)
                for axis, name in enumerate("xyz"):
                    self.assertEqual([float(row[f"force_{name}"]) for row in rows], list(got["rendered"][:, axis]))
                self.assertEqual([float(row["depth"]) for row in rows], list(got["depth"]))
                self.assertGreater(abs(got["rendered"]).max(), 0.1)

    def test_scenes_are_checked_against_the_device_and_every_fault_has_its_place(self):
        self.serve(scene=False)
        with self.client() as hand:
            self.assertIsNone(hand.server["scene"])
            self.refused("no-scene", hand.start)
            stiff = {"objects": [BALL["objects"][0], {**BALL["objects"][0], "stiffness_n_per_m": 90000}]}
            self.assertEqual(self.refused("too-stiff", hand.load, stiff).place, "/objects/1")
            bad = {"objects": [{"shape": "sphere"}, {"shape": "cubus", "edge_m": -1}]}
            faults = self.refused("bad-scene", hand.load, bad).faults
            self.assertGreaterEqual({fault["place"] for fault in faults}, {"/objects/0/radius_m", "/objects/1/shape"})
            self.refused("cannot-be-shown", hand.load, {**BALL, "reach": {"factor": 2, "pivot": "grip"}})
            hand.load(BALL)
            hand.start()
            hand.set("/objects/0/stiffness_n_per_m", 40)
            hand.wait_for("set")
            self.refused("too-stiff", hand.set, "/objects/0/stiffness_n_per_m", 90000)
            self.refused("bad-scene", hand.set, "/objects/0/stiffness_n_per_m", "soft")
            self.refused("bad-scene", hand.set, "/objects/0/stifness", 3)
            self.refused("bad-message", hand.set, "/objects/9/stiffness_n_per_m", 3)
            hand.stop()
        with self.client(role="watch") as eye:
            self.assertEqual(eye.server["scene"]["objects"][0]["stiffness_n_per_m"], 40)

    def test_the_token_never_replaces_another_file(self):
        study = self.dir / "study.db"
        study.write_text("precious")
        done = subprocess.run([PALPATE, "serve", "--device", "simulated", "--scene", self.scene, "--token-file", study],
                              capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual((done.returncode, study.read_text()), (2, "precious"))
        self.assertIn("study.db exists and holds no token; name another file", done.stderr)

    def test_only_clients_with_the_token_are_accepted(self):
        token = self.dir / "token.json"
        token.write_text('{"type":"serving","url":"ws://127.0.0.1:1","of":"a server that was killed"}\n')
        token.chmod(0o644)
        process = self.serve("--token-file", token)
        self.assertNotIn("token", self.said)
        self.said = json.loads(token.read_text())
        self.assertEqual(stat.S_IMODE(token.stat().st_mode), 0o600)
        self.assertEqual(stat.S_IMODE(self.path.stat().st_mode), 0o600)
        self.assertRegex(self.said["token"], "^[0-9a-f]{32}$")
        for wrong in ("", "0" * 32, self.said["token"][:-1], self.said["token"] + "0"):
            self.refused("bad-token", Client, self.said["url"], wrong, time_out=PATIENCE)
        link = self.lines()
        link.send('{"id": 1, "type": "start"}')
        self.assertEqual(self.hears(link)["error"]["code"], "no-hello")
        self.assertIsNone(link.receive())
        with Client.from_token_file(token, time_out=PATIENCE) as hand:
            self.refused("controlled", self.client)
            with contextlib.ExitStack() as stack:
                eyes = [stack.enter_context(self.client(role="watch")) for _ in range(8)]
                self.refused("full", self.client, role="watch")
                self.refused("not-controller", eyes[0].start)
                hand.note("all see it")
                for eye in eyes:
                    self.assertEqual(eye.wait_for("note", PATIENCE)["text"], "all see it")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(PATIENCE), 0)
        self.assertFalse(token.exists() or self.path.exists())

    def test_a_second_server_leaves_the_first_ones_files(self):
        token = self.dir / "token.json"
        first = self.serve("--token-file", token)
        said = token.read_text()
        command = [PALPATE, "serve", "--device", "simulated", "--scene", self.scene, "--token-file"]
        done = subprocess.run([*command, token], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual((done.returncode, token.read_text()), (2, said))
        self.assertIn("belongs to a server that runs", done.stderr)
        pipe = self.dir / "pipe"
        os.mkfifo(pipe)
        done = subprocess.run([*command, pipe], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.returncode, 2)
        self.assertIn("holds no token", done.stderr)
        # Somebody removes the files, and a second server takes the names: the first leaves them alone at its end.
        token.unlink()
        self.path.unlink()
        second = self.serve("--token-file", token)
        first.send_signal(signal.SIGINT)
        self.assertEqual(first.wait(PATIENCE), 0)
        self.said = json.loads(token.read_text())
        self.assertTrue(self.hello(self.lines(), role="watch")["ok"])
        # A killed server's file at the port that the next one gets.
        second.kill()
        second.wait(PATIENCE)
        third = self.serve("--token-file", token, "--port", self.said["url"].rsplit(":", 1)[1])
        third.send_signal(signal.SIGINT)
        self.assertEqual(third.wait(PATIENCE), 0)
        self.assertFalse(token.exists() or self.path.exists())

    def test_an_emergency_is_not_undone_by_a_clear_that_was_said_before(self):
        self.serve(scene=False)
        hand, eye = self.lines(), self.client(role="watch")
        self.assertTrue(self.hello(hand)["ok"])
        ball = BALL["objects"][0]
        slow = {"objects": [{**ball, "subdivisions": 6, "position_m": [0, 0, 0.001 * i]} for i in range(12)]}
        hand.send(json.dumps({"id": 1, "type": "load", "scene": slow}))  # takes the session's thread a while
        hand.send('{"id": 2, "type": "load", "scene": ' + json.dumps(BALL) + "}")
        hand.send('{"id": 3, "type": "clear"}')
        hand.send('{"id": 4, "type": "start"}')
        hand.send('{"id": 5, "type": "alive"}')
        self.assertEqual(self.hears(hand)["re"], 5)  # the others wait for the session
        eye.emergency()
        replies = {reply["re"]: reply for reply in (self.hears(hand) for _ in range(4))}
        self.assertTrue(replies[1]["ok"] and replies[2]["ok"], replies)
        for number in (3, 4):
            self.assertEqual(replies[number]["error"]["code"], "emergency")
        eye.clear()
        hand.send('{"id": 6, "type": "start"}')
        self.assertTrue(self.hears(hand)["ok"])

    def test_a_client_that_reads_nothing_is_closed_before_it_takes_much_memory(self):
        process = self.serve(scene=False)
        hand = self.client()
        hand.load({"objects": [{**BALL["objects"][0], "subdivisions": 6}]})
        eye = self.lines()
        self.assertTrue(self.hello(eye, role="watch")["ok"])

        def resident():
            return int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")

        hand.ask("picture")
        before = resident()
        with contextlib.suppress(OSError):
            for number in range(190):
                eye.send(json.dumps({"id": number, "type": "picture"}))
        hand.ask("alive")
        time.sleep(0.2)
        self.assertLess(resident() - before, 24 << 20)
        eye.socket.settimeout(PATIENCE)
        with self.assertRaises((TypeError, OSError)):  # closed
            for _ in range(190):
                json.loads(eye.receive())

    def test_foreign_pages_are_refused(self):
        self.serve("--allow-origin", "http://lab.example")
        host = "Host: " + self.said["url"][5:]
        socket_ = ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
                   "Sec-WebSocket-Version: 13"]
        speaks = "Sec-WebSocket-Protocol: palpate.1"
        self.assertEqual(self.http(host, *socket_, speaks), 101)
        self.assertEqual(self.http(host, *socket_, speaks, "Origin: http://lab.example"), 101)
        self.assertEqual(self.http(host, *socket_, speaks, "Origin: http://evil.example"), 403)
        self.assertEqual(self.http(host, *socket_, speaks, "Origin: null"), 403)
        self.assertEqual(self.http("Host: evil.example:80", *socket_, speaks), 403)
        self.assertEqual(self.http(*socket_, speaks), 403)
        self.assertEqual(self.http(host, *socket_), 400)
        self.assertEqual(self.http(host, *socket_, "Sec-WebSocket-Protocol: palpate.2"), 400)
        self.assertEqual(self.http(host), 200)  # the page, which does not contain the token
        self.assertIsNone(self.http(host, "X: " + "x" * 20000))

    def test_silent_and_flooding_connections_are_closed(self):
        self.serve()
        port = int(self.said["url"].rsplit(":", 1)[1])
        silent = self.lines()
        half = self.lines()
        half.socket.sendall(b'{"id": 1')
        request = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        self.addCleanup(request.close)
        request.sendall(b"GET / HTT")
        began = time.monotonic()
        for link in (silent.socket, half.socket, request):
            self.assertEqual(link.recv(10), b"")
        self.assertGreater(time.monotonic() - began, 1.5)
        long = self.lines()
        with contextlib.suppress(OSError):
            long.socket.sendall(b"x" * 200_000)
            self.assertEqual(long.socket.recv(10), b"")
        # Before its hello a WebSocket is limited to 64 kB too.
        web = client._WebSocket(self.said["url"], PATIENCE)
        self.addCleanup(web.socket.close)
        with contextlib.suppress(OSError, ConnectionError):
            web.send("x" * 100_000)
            self.assertIsNone(web.receive())
        with self.client() as hand:
            self.refused("too-long", hand.ask, "note", text="x" * 70_000)
        flood = self.lines()
        self.assertTrue(self.hello(flood, role="watch")["ok"])
        with contextlib.suppress(OSError):
            for number in range(1000):
                flood.send(json.dumps({"id": number, "type": "alive"}))
        codes = []
        with contextlib.suppress(TypeError, OSError):
            while True:
                codes.append(self.hears(flood).get("error", {}).get("code"))
        self.assertIn("busy", codes)
        self.assertLess(len(codes), 1000)

    def test_programs_without_the_token_keep_nobody_out(self):
        self.serve()
        port = int(self.said["url"].rsplit(":", 1)[1])
        held, end = [], time.monotonic() + 3

        def crowd():
            while time.monotonic() < end:
                with contextlib.suppress(OSError):
                    link = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
                    held.append(link)
                    if len(held) % 2:
                        link.sendall(b"GET / HTT")
                    if len(held) > 300:
                        held.pop(0).close()
                time.sleep(0.002)
        crowding = threading.Thread(target=crowd)
        crowding.start()
        self.addCleanup(lambda: [link.close() for link in held])
        self.addCleanup(crowding.join)
        while len(held) < 150:
            time.sleep(0.01)
        for _ in range(10):
            with self.client(), self.client(role="watch"):
                pass
            link = self.lines()
            self.assertTrue(self.hello(link, role="watch")["ok"])
            link.socket.close()

    def test_frames_without_contents_count_against_a_client(self):
        self.serve()
        hand = self.client()
        for frame in (client._frame(9, b""), b"\x00\x80abcd"):  # pings; empty fragments of a message that never ends
            eye = client._WebSocket(self.said["url"], PATIENCE)
            self.addCleanup(eye.socket.close)
            eye.send(json.dumps({"id": 0, "type": "hello", "token": self.said["token"], "version": 1, "role": "watch"}))
            self.assertTrue(json.loads(eye.receive())["ok"])
            threading.Thread(target=self.read_all, args=(eye.socket,), daemon=True).start()
            if frame[0] == 0:
                eye.socket.sendall(b"\x01\x80abcd")
            with self.assertRaises(OSError):
                end = time.monotonic() + PATIENCE
                while time.monotonic() < end:
                    eye.socket.sendall(frame * 10_000)
            began = time.monotonic()
            hand.ask("alive")
            self.assertLess(time.monotonic() - began, 5)

    @staticmethod
    def read_all(link):
        with contextlib.suppress(OSError):
            while link.recv(65536):
                pass

    def test_messages_and_their_schema_agree(self):
        self.serve()
        says, answers = schemas()
        link = self.lines()
        self.assertTrue(self.hello(link)["ok"])
        for text in GOOD:
            self.assertTrue(says.is_valid(json.loads(text)), text)
            link.send(text)
            reply = self.hears(link)
            self.assertTrue(reply["ok"] and answers.is_valid(reply), (text, reply))
        for text in BAD:
            self.assertFalse(says.is_valid(json.loads(text)), text)
            link.send(text)
            reply = self.hears(link)
            self.assertFalse(reply["ok"], text)
            self.assertEqual(reply["error"]["code"], "bad-message", text)
            self.assertTrue(answers.is_valid(reply), reply)
        for text in NO_JSON[1:]:
            link.socket.sendall(text.encode("latin-1") + b"\n")
            reply = self.hears(link)
            self.assertEqual((reply["re"], reply["error"]["code"]), (None, "bad-json"), text[:50])
            self.assertTrue(answers.is_valid(reply), reply)

    def test_silence_ends_forces_until_clear(self):
        self.serve()
        eye = self.client(role="watch")
        with self.client(keep_alive=False) as hand:
            while True:
                hand.start()
                if self.one_of(eye, "client_silent", "forces_off")["event"] == "client_silent":
                    break
                hand.stop()
                hand.clear()
            self.assertEqual(eye.wait_for("forces_off", PATIENCE)["reason"], "the client was silent")
            hand.stop()
            self.refused("forces-off", hand.start)
            hand.clear()
            eye.subscribe(1000, ("force",))
            hand.start()
            said = [time.monotonic()]
            for _ in range(10):
                time.sleep(0.1)
                hand.ask("alive")
                said.append(time.monotonic())
            hand.stop()
            if max(after - before for before, after in zip(said, said[1:])) < 0.4:  # otherwise this machine stood still
                self.assertEqual([e for e in eye.events() if e["event"] == "client_silent"], [])

    def test_every_client_may_request_zero_force(self):
        self.serve()
        eye, hand = self.client(role="watch"), self.client()
        hand.subscribe(1000, ("force", "faults"))
        self.touch(hand)
        time.sleep(0.1)
        eye.emergency()
        off = hand.wait_for("forces_off", PATIENCE)
        self.assertEqual(off["code"], "emergency")
        time.sleep(0.3)
        got = hand.samples()
        after = got["t_ns"] >= off["t_ns"]
        self.assertTrue(after.any())
        self.assertFalse(got["force"][after].any())
        self.assertTrue(got["force"][~after].any())
        hand.stop()
        self.refused("emergency", hand.start)
        self.refused("emergency", hand.clear)
        eye.clear()
        self.refused("not-controller", eye.clear)  # there is nothing of its own any more
        hand.start()
        eye.events()
        # Forces end if the controller disconnects without a message.
        hand._link.socket.shutdown(socket.SHUT_RDWR)
        self.assertEqual(eye.wait_for("stopped", PATIENCE)["reason"], "the controller has left")
        other = self.client()
        with contextlib.suppress(ServeError):  # the trial has ended, or forces are off
            other.stop()
        other.clear()
        other.start()
        other.stop()

    def test_an_emergency_is_cleared_where_it_was_raised_or_at_the_server(self):
        self.serve()
        eye, hand = self.client(role="watch"), self.client()
        hand.emergency()
        eye.emergency()
        self.refused("emergency", hand.clear)
        self.refused("emergency", eye.clear)
        eye.close()  # nobody can clear it over the network now
        for _ in range(3):
            self.refused("emergency", hand.clear)
        other = self.client(role="watch")
        self.refused("not-controller", other.clear)
        self.assertIn("emergency by client", self.refused("emergency", hand.start).message)

    def test_a_person_at_the_server_clears_an_emergency(self):
        with Terminal([PALPATE, "serve", "--device", "simulated", "--scene", self.scene, "--rate", "100"]) as terminal:
            terminal.wait_for("}\n")
            self.said = json.loads(terminal.text)
            eye, hand = self.client(role="watch"), self.client()
            eye.emergency()
            eye.close()
            terminal.wait_for("the word clear is typed here")
            self.refused("emergency", hand.start)
            terminal.type("celar\n")
            self.refused("emergency", hand.start)
            terminal.type("clear\n")
            terminal.wait_for("cleared")
            hand.wait_for("cleared", PATIENCE)
            hand.start()
            hand.stop()

    def test_clocks(self):
        self.serve()
        with self.client() as hand:
            clock = hand.clock(30)
            self.assertLess(abs(clock.offset_ns), clock.round_trip_ns / 2 + 1)  # both are CLOCK_MONOTONIC
            self.assertEqual(hand.ask("clock", t_client=0.25)["t_client"], 0.25)

    def test_an_answers_own_time_counts_if_the_clock_is_known(self):
        self.serve()

        def answered(hand):
            hand.stop()
            hand.clear()
            hand.start()
            time.sleep(0.05)
            now = time.monotonic_ns()
            hand.ask("alive")
            said = hand.ask("answer", response="x", t_ns=now)
            self.assertEqual(said["t_ns"] == now, said["stamped"] == "client")
            self.assertGreaterEqual(said["t_ns"], now)
            return said["stamped"]

        with self.client() as hand:
            self.assertEqual(answered(hand), "arrival")
            for _ in range(5):  # without a seen answer its sending time has no lower bound
                self.assertFalse(hand.ask("clock", t_client=time.monotonic_ns())["known"])
            for seen in (1, time.monotonic_ns(), 2**62):  # no answer was sent at that time
                self.assertFalse(hand.ask("clock", t_client=time.monotonic_ns(), t_seen_ns=seen)["known"])
            self.assertEqual(answered(hand), "arrival")
            self.know_the_clock(hand)
            self.assertEqual(answered(hand), "client")
            # The time of another clock is known too, after `clock` messages; that of a clock that was set is not.
            seen = hand.ask("clock", t_client=time.monotonic_ns() + 5e9)["t_sent_ns"]
            self.assertEqual(answered(hand), "arrival")
            while not (said := hand.ask("clock", t_client=time.monotonic_ns() + 5e9, t_seen_ns=seen))["known"]:
                seen = said["t_sent_ns"]
            self.know_the_clock(hand)
            hand.start()
            zero = time.monotonic_ns()
            self.refused("bad-message", hand.ask, "answer", response="x", t_ns=zero - 3_000_000_000)
            self.refused("bad-message", hand.ask, "answer", response="x", t_ns=zero + 3_000_000_000)

    def test_a_material_changes_under_the_hand(self):
        self.serve()
        with self.client() as hand:
            hand.subscribe(1000, ("rendered", "depth", "faults"))
            while True:
                hand.samples()
                self.touch(hand)
                hand.set("/objects/0/stiffness_n_per_m", 20)
                time.sleep(0.5)
                hand.stop()
                time.sleep(0.1)
                got = hand.samples()
                if not (got["faults"].astype(int) & 64).any():  # on a busy machine ticks are missed
                    break
                hand.clear()
            begin = len(got["tick"]) - 1 - list(got["tick"][::-1]).index(0)
            self.assertGreater(len(got["tick"]) - begin, 40)  # it was not begun again
            depth, force = got["depth"][begin:], (got["rendered"][begin:] ** 2).sum(axis=1) ** 0.5
            touched = depth > 1e-4
            self.assertGreater(touched.sum(), 20)
            stiffness = force[touched] / depth[touched]
            self.assertAlmostEqual(stiffness[0], 50, places=3)
            self.assertAlmostEqual(stiffness[-1], 20, places=3)
            self.assertGreater(stiffness.min(), 19.99)
            self.assertLess(abs(stiffness[1:] - stiffness[:-1]).max(), 30 * 0.1)  # a ramp of 20 ticks

    def test_set_reaches_only_members_of_the_scene(self):
        server = self.serve(scene=False)
        memory = pathlib.Path(f"/proc/{server.pid}/statm")
        placed = {"objects": [{**BALL["objects"][0], "position_m": [0, 0, 0]}]}
        with self.client() as hand:
            hand.load(placed)
            before = int(memory.read_text().split()[1])
            for path in ("/objects/-", "/objects/1", "/objects/2000000000", "/objects/0/position_m/2000000000",
                         "/objects/0/position_m/-", "/objects/0/position_m/x", "/objects/~2", "/objects/00/radius_m", "/objects/"):
                self.refused("bad-message", hand.set, path, 0.001)
            self.assertLess(int(memory.read_text().split()[1]) - before, 2000)  # pages
            hand.set("/objects/0/position_m/1", 0.001)
            self.assertEqual(placed["objects"][0]["position_m"], [0, 0, 0])
        with self.client(role="watch") as eye:
            self.assertEqual(eye.server["scene"]["objects"][0]["position_m"], [0, 0.001, 0])

    def test_a_watcher_that_does_not_read_loses_only_its_own_rows(self):
        self.serve(rate=1000)
        hand = self.client()
        deaf = self.lines()
        deaf.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.assertTrue(self.hello(deaf, role="watch")["ok"])
        deaf.send(json.dumps({"id": 1, "type": "subscribe", "rate_hz": 1000, "fields": ["tip", "tail", "force", "rendered"]}))
        hand.subscribe(1000, ("force",))
        hand.start()
        time.sleep(3)
        hand.stop()
        time.sleep(0.1)
        self.assertEqual(hand.dropped, 0)
        self.assertGreater(len(hand.samples()["tick"]), 100)
        dropped = 0
        deaf.socket.settimeout(0.5)
        with contextlib.suppress(OSError):
            while True:
                dropped += json.loads(deaf.receive()).get("dropped", 0)
        self.assertGreater(dropped, 0)

    def test_devices_are_named_as_for_run(self):
        for command in (["serve", "--scene", self.scene], ["explore", self.scene]):
            for device, option, words in (("falcon2", ["--serial", "A"], "--serial: "),
                                          ("touch", ["--library", self.dir / "none.so"], "none.so"),
                                          ("inverse3", ["--service", "127.0.0.1:9"], "127.0.0.1:9")):
                done = subprocess.run([PALPATE, *command, "--device", device, *option], capture_output=True, text=True,
                                      timeout=PATIENCE)
                self.assertIn(words, done.stderr, (command, device))

    def test_wrong_use(self):
        process = self.serve()
        port = self.said["url"].rsplit(":", 1)[1]
        run = [PALPATE, "serve", "--device", "simulated"]
        for options, said in ((["--port", port], "another server may run"), (["--socket", self.path], "another server uses it")):
            done = subprocess.run([*run, *options], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn(said, done.stderr)
        self.scene.write_text(json.dumps({"objects": [{**BALL["objects"][0], "stiffness_n_per_m": 90000}]}))
        for options, said in ((["--scene", self.scene], "/objects/0: "), (["--port", "70000"], "65535"),
                              (["--scene", self.dir / "none"], "none")):
            done = subprocess.run([*run, *options], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)
            self.assertIn(said, done.stderr)
        self.assertTrue(self.path.exists())
        process.kill()
        process.wait(PATIENCE)
        self.scene.write_text(json.dumps(BALL))
        again = self.serve()  # beside the socket left behind
        with self.client() as hand:
            hand.start()
            again.send_signal(signal.SIGTERM)
            self.assertEqual(again.wait(PATIENCE), 0)


if __name__ == "__main__":
    unittest.main()
