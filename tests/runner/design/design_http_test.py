"""palpate design without a browser: who may ask, what is answered, what is written and what is not.

Usage: design_http_test.py PALPATE PROTOCOLS
"""

import base64
import hashlib
import json
import math
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import unittest

sys.dont_write_bytecode = True
from design_case import PALPATE, PATIENCE, PROTOCOLS, DesignCase  # noqa: E402

PROTOCOL_FILES = sorted(path for path in PROTOCOLS.glob("*.json") if ".texts." not in path.name and "schema" not in path.name)


def sha256(text):
    return hashlib.sha256(text.encode()).hexdigest()


class Access(DesignCase):
    def setUp(self):
        super().setUp()
        self.design(self.copy("quick.json"))

    def test_the_page_carries_no_token(self):
        status, headers, body = self.request("GET", "/")
        self.assertEqual(status, 200)
        self.assertNotIn(self.token.encode(), body)
        policy = headers["Content-Security-Policy"]
        nonce = re.search("script-src 'nonce-([0-9a-f]{32})'", policy)[1]
        self.assertIn("default-src 'none'", policy)
        self.assertIn("connect-src 'self'", policy)
        self.assertIn("frame-ancestors 'none'", policy)
        self.assertIn(f'nonce="{nonce}"'.encode(), body)
        self.assertEqual(headers["Cache-Control"], "no-store")
        self.assertEqual(headers["Referrer-Policy"], "no-referrer")
        again = self.request("GET", "/")[1]["Content-Security-Policy"]
        self.assertNotIn(nonce, again)

    def test_messages_need_the_token(self):
        for token in ("", "0" * 32, self.token[:-1], self.token + "0"):
            status, _, body = self.request("POST", "/open", "{}", X_Palpate_Token=token)
            self.assertEqual((status, body), (403, b"this is not the server's token\n"))
        self.assertEqual(self.request("POST", "/open", "{}")[0], 403)
        self.assertEqual(self.request("GET", "/open")[0], 404)
        self.assertEqual(self.request("PUT", "/open", "{}", X_Palpate_Token=self.token)[0], 405)

    def test_foreign_names_and_origins_are_refused(self):
        for host in ("palpate.example", f"evil.example:{self.port}", "127.0.0.1.evil.example"):
            self.assertEqual(self.request("GET", "/", Host=host)[0], 403, host)
        for origin in ("https://evil.example", "null", f"http://127.0.0.1:{self.port + 1}"):
            status, headers, _ = self.request("POST", "/open", "{}", X_Palpate_Token=self.token, Origin=origin)
            self.assertEqual(status, 403, origin)
            self.assertNotIn("Access-Control-Allow-Origin", headers)
        own = f"http://127.0.0.1:{self.port}"
        self.assertEqual(self.request("POST", "/open", "{}", X_Palpate_Token=self.token, Origin=own)[0], 200)
        # A browser asks first whether another origin may send the header: it may not.
        status, headers, _ = self.request("OPTIONS", "/open", Origin="https://evil.example")
        self.assertEqual(status, 403)
        self.assertNotIn("Access-Control-Allow-Headers", headers)

    def test_bodies_above_16_mib_are_refused(self):
        status, _, body = self.request("POST", "/check", b'{"text":"' + b"x" * (17 << 20) + b'"}', X_Palpate_Token=self.token)
        self.assertEqual((status, body), (413, b"at most 16777216 bytes\n"))
        text = "x" * (15 << 20)
        self.assertEqual(self.ask("check", text=text)["faults"][0]["pointer"], "line 1, column 1")

    def test_slow_headers_are_closed(self):
        began = time.monotonic()
        with socket.create_connection(("127.0.0.1", self.port), PATIENCE) as slow:
            slow.sendall(b"POST /open HTTP/1.1\r\nHost: 127.0.0.1\r\n")
            self.assertEqual(self.ask("open")["name"], "p.json")  # others are not held up
            self.assertEqual(slow.recv(100), b"")
        self.assertGreater(time.monotonic() - began, 1)

    def test_a_hundred_open_connections_shut_nobody_out(self):
        waiting = [socket.create_connection(("127.0.0.1", self.port), PATIENCE) for _ in range(100)]
        self.assertEqual(self.ask("open")["name"], "p.json")
        for one in waiting:
            one.close()

    def test_unreadable_messages_are_refused(self):
        for body in ("", "[]", "{", "7", '{"text": 7}', "\xff"):
            status, _, answer = self.request("POST", "/check", body.encode("latin-1"), X_Palpate_Token=self.token)
            self.assertIn(status, (400, 409), body)
            self.assertIn("error", json.loads(answer))
        self.ask("schedule", 409, text="{}", participant=0)
        self.ask("rehearse", 409, text="{}", participants=1000)
        self.assertEqual(self.request("POST", "/mystery", '{"text": ""}', X_Palpate_Token=self.token)[0], 404)
        self.assertEqual(self.request("GET", "/../p.json")[0], 404)
        self.assertEqual(self.request("GET", "/report/" + "0" * 32)[0], 404)


class Opening(DesignCase):
    def test_a_browser_reads_a_private_file(self):
        # Stands for the user's: it notes what it is given and what it has inherited.
        browser = self.dir / "xdg-open"
        browser.write_text("""#!/bin/sh
{ echo "$1"; stat -c %a "$1"; cat "$1"; for f in /proc/self/fd/*; do readlink "$f"; done; } > "$NOTE.draft" 2> /dev/null
mv "$NOTE.draft" "$NOTE"
""")
        browser.chmod(0o755)
        note = self.dir / "note"
        environment = {**os.environ, "TMPDIR": str(self.temporary), "PATH": f"{self.dir}:{os.environ['PATH']}", "DISPLAY": ":77", "NOTE": str(note)}
        process = subprocess.Popen([PALPATE, "design", self.copy("quick.json")], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                   env=environment)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        address = process.stdout.readline().strip()
        self.until(note.exists)
        path, mode, *rest = note.read_text().splitlines()
        self.assertTrue(path.startswith(str(self.temporary)), path)
        self.assertEqual(mode, "600")
        self.assertIn(f'<a href="{address}">', "\n".join(rest))
        self.assertNotIn(address, path)  # other users can read a command line
        self.assertFalse([line for line in rest if line.startswith("socket:")], rest)
        self.assertEqual(self.end(process), 0)
        self.assertEqual(list(self.temporary.iterdir()), [])


class Answers(DesignCase):
    def test_the_check_says_what_validate_says(self):
        self.design(self.copy("quick.json"))
        for path in PROTOCOL_FILES:
            if '"file"' in path.read_text():
                continue
            with self.subTest(path.name):
                said = subprocess.run([PALPATE, "validate", "--json", path], capture_output=True, text=True, timeout=PATIENCE)
                expected, found = json.loads(said.stdout), self.ask("check", text=path.read_text(encoding="utf-8"))
                for key in ("faults", "summary", "devices", "duration_s", "longest_s", "notes"):
                    self.assertEqual(found[key], expected[key], key)

    def test_faults_of_bad_files_are_those_of_validate(self):
        folder = self.dir / "bad"
        shutil.copytree(pathlib.Path(__file__).parents[2] / "protocols" / "bad", folder)
        self.design(folder / "new.json")
        bad = sorted(folder.glob("*.json"))
        self.assertGreater(len(bad), 20)
        for path in bad:
            try:
                text = path.read_text(encoding="utf-8")
            except UnicodeDecodeError:
                continue
            if '"objects"' in text and '"version"' not in text:
                continue  # a scene
            with self.subTest(path.name):
                said = subprocess.run([PALPATE, "validate", "--json", path], capture_output=True, text=True, timeout=PATIENCE)
                faults = self.ask("check", text=text)["faults"]
                self.assertTrue(faults)
                self.assertEqual([(one["pointer"], one["line"], one["text"]) for one in faults],
                                 [(one["pointer"], one["line"], one["text"]) for one in json.loads(said.stdout)["faults"]])

    def test_the_order_is_that_of_schedule(self):
        self.design(self.copy("quick.json"))
        for name, varied in (("quick.json", set()), ("stiffness-two-groups.json", {"reference", "stiffness"}),
                             ("stiffness-surface-size.json", {"surface", "size"})):
            said = subprocess.run([PALPATE, "schedule", PROTOCOLS / name, "--participant", "2", "--format", "json"],
                                  capture_output=True, text=True, timeout=PATIENCE, check=True)
            trials = json.loads(said.stdout)["trials"]
            found = self.ask("schedule", text=(PROTOCOLS / name).read_text(encoding="utf-8"), participant=2)
            self.assertEqual(found["all"], len(trials))
            self.assertEqual([dict(zip(found["columns"], row)) for row in found["rows"]],
                             [{column: flat.get(column) for column in found["columns"]}
                              for flat in ({**trial, **trial.get("levels", {}), **trial.get("factors", {})} for trial in trials)])
            self.assertEqual(len(found["columns"]), len(set(found["columns"])))
            self.assertLessEqual(varied, set(found["columns"]))
            self.assertEqual(found.get("group"), "older" if "groups" in name else None)

    def test_the_picture_has_true_sizes(self):
        self.design(self.copy("quick.json"))
        picture = self.ask("picture", text=(self.dir / "p.json").read_text())
        sizes = {one["name"]: one["size_m"] for one in picture["stimuli"]}
        self.assertEqual(set(sizes), {"sphere", "cone", "cylinder", "cube"})
        for name, expected in (("cube", [0.06] * 3), ("cone", [0.06] * 3), ("sphere", [0.06] * 3)):
            for got, wanted in zip(sizes[name], expected):
                self.assertAlmostEqual(got, wanted, delta=2e-4)
        self.assertEqual(picture["stylus"]["length_m"], 0.12)
        for one in picture["stimuli"]:
            self.assertLess(max(map(max, one["triangles"])), len(one["corners"]))


    def test_fields_textures_and_what_is_seen_are_in_the_picture(self):
        self.design(self.copy("grating-roughness.json"))
        shown = {one["name"]: one for one in self.ask("picture", text=(self.dir / "p.json").read_text())["stimuli"] if "at" not in one}
        text = json.loads((self.dir / "p.json").read_text())
        ridged = next(one for one in text["stimuli"] if "texture" in one)
        period = ridged["texture"]["period_m"]
        marks = shown[ridged["name"]]["marks"]
        self.assertEqual((marks["every"], marks["dots"]), (1, []))
        # On the top face neighbouring crests are a period apart, and one goes through the origin.
        top = max(corner[2] for corner in shown[ridged["name"]]["corners"])
        places = sorted({round(end[0], 6) for line in marks["lines"] for end in line if abs(end[2] - top) < 1e-6})
        steps = [b - a for a, b in zip(places, places[1:])]
        self.assertGreater(len(steps), 10)
        for step in steps[1:-1]:
            self.assertAlmostEqual(step, period, delta=2e-6)
        self.assertLess(min(abs(place) for place in places), 2e-6)
        round_one = {**ridged, "name": "round", "shape": "cylinder", "radius_m": 0.02, "height_m": 0.05}
        round_one.pop("size_m", None)
        cones = {**ridged, "name": "cones", "texture": {"kind": "cones", "period_m": 0.004, "depth_m": 0.0004}}
        round_one["texture"] = {"kind": "sine", "period_m": 0.004, "depth_m": 0.0004, "direction": "around"}
        free = {"name": "free", "shape": "none", "fields": [
            {"kind": "channel", "from_m": [0, 0, 0], "to_m": [0.05, 0, 0], "half_width_m": 0.002, "stiffness_n_per_m": 100},
            {"kind": "constant", "force_n": [0, 0, 1]}]}
        view = {"screen_m": [[-0.26, 0.25, -0.16], [0.26, 0.25, -0.16], [-0.26, 0.25, 0.16]], "eye_m": [0, -0.4, 0.1]}
        large = {"name": "large", "shape": "sphere", "radius_m": 0.02, "seen": {"what": "object", "size_ratio": 1.5}}
        same = {"name": "same", "shape": "sphere", "radius_m": 0.02, "seen": {"what": "object"}}
        made = {"version": 2, "name": "made", "renderers": ["point"], "orientation": "fixed", "view": view,
                "stimuli": [round_one, cones, free, large, same],
                "blocks": [{"name": "a", "task": "rate", "question": "How?", "stimuli": ["round"], "scale": [{"label": "a"}, {"label": "b"}], "repetitions": 1}]}
        shown = {one["name"]: one for one in self.ask("picture", text=json.dumps(made))["stimuli"]}
        ridges = round(2 * math.pi * 0.02 / 0.004)
        side = [line for line in shown["round"]["marks"]["lines"] if abs(math.hypot(*line[0][:2]) - 0.02) < 1e-4 and abs(line[0][2] - line[1][2]) > 1e-3]
        turns = {round(math.atan2(line[0][1], line[0][0]) * ridges / (2 * math.pi)) % ridges for line in side}
        self.assertEqual(len(turns), ridges)
        self.assertEqual(shown["cones"]["marks"]["lines"], [])
        self.assertGreater(len(shown["cones"]["marks"]["dots"]), 300)
        self.assertEqual([one["kind"] for one in shown["free"]["fields"]], ["channel", "constant"])
        self.assertEqual(shown["free"]["corners"], [])
        self.assertAlmostEqual(shown["large"]["seen"]["size_m"][0], 0.06, delta=0.001)
        self.assertNotIn("seen", shown["same"])

    def pictures(self, made):
        return self.ask("picture", text=json.dumps(made))["stimuli"]

    def test_levels_that_look_other_are_in_the_picture(self):
        path = self.copy("size-questplus.json")
        self.design(path)
        levels = json.loads(path.read_text())["blocks"][1]["procedure"]["levels"]
        shown = self.ask("picture", text=path.read_text())["stimuli"]
        self.assertEqual([(one["name"], [at["value"] for at in one.get("at", [])]) for one in shown],
                         [("standard", []), ("comparison", []), ("comparison", [min(levels)]), ("comparison", [max(levels)])])
        for one in shown:
            radius = one["at"][0]["value"] if "at" in one else 0.025
            self.assertAlmostEqual(one["size_m"][0], 2 * radius, delta=2e-4)
        self.assertNotIn("varied", shown[0])
        self.assertEqual({range["block"]: range["numbers"] for range in shown[1]["varied"]}["size"],
                         [{"path": "/radius_m", "least": min(levels), "most": max(levels)}])
        made = {"version": 2, "name": "made", "renderers": ["point"], "orientation": "fixed",
                "stimuli": [{"name": "block", "shape": "box", "size_m": [0.02, 0.03, 0.04]}, {"name": "other", "shape": "sphere", "radius_m": 0.02}],
                "blocks": [{"name": "a", "task": "rate", "question": "How?", "stimuli": ["block"], "scale": [{"label": "a"}, {"label": "b"}],
                            "level": {"dimensions": [{"name": "wide", "path": "/size_m/0"}, {"name": "high", "path": "/size_m/2"}]},
                            "procedure": {"kind": "constant", "levels": [[0.01, 0.05], [0.03, 0.02], [0.02, 0.03]], "repetitions": 1}}]}
        # The least and the greatest of each number, at points that are shown.
        shown = self.pictures(made)
        ends = sorted(tuple(at["value"] for at in one["at"]) for one in shown if "at" in one)
        self.assertEqual(ends, [(0.01, 0.05), (0.03, 0.02)])
        for one in shown:
            if "at" in one:
                self.assertEqual([round(side, 6) for side in one["size_m"]], [one["at"][0]["value"], 0.03, one["at"][1]["value"]])
        self.assertEqual([number["name"] for number in shown[0]["varied"][0]["numbers"]], ["wide", "high"])
        # A stiffness looks like nothing: it is in words alone.
        block = made["blocks"][0]
        block["level"], block["procedure"] = {"path": "/stiffness_n_per_m"}, {"kind": "constant", "levels": [100, 300], "repetitions": 1}
        shown = self.pictures(made)
        self.assertEqual([one["name"] for one in shown], ["block", "other"])
        self.assertEqual(shown[0]["varied"], [{"block": "a", "numbers": [{"path": "/stiffness_n_per_m", "least": 100, "most": 300}]}])
        # A turn turns.
        block["level"], block["procedure"]["levels"] = {"path": "/orientation", "axis": [0, 0, 1]}, [0, 90]
        shown = [one for one in self.pictures(made) if "at" in one]
        self.assertEqual([one["at"][0]["value"] for one in shown], [90])
        for got, wanted in zip(shown[0]["turn_wxyz"], (math.sqrt(0.5), 0, 0, math.sqrt(0.5))):
            self.assertAlmostEqual(got, wanted)

    def test_what_a_group_feels_otherwise_is_in_the_picture(self):
        self.design(self.copy("quick.json"))
        ball = {"name": "ball", "shape": "sphere", "radius_m": 0.02}
        block = {"name": "a", "task": "rate", "question": "How?", "stimuli": ["ball"], "scale": [{"label": "a"}, {"label": "b"}],
                 "level": {"path": "/radius_m"}, "procedure": {"kind": "constant", "levels": [0.02, 0.03], "repetitions": 1}}
        other = {**block, "procedure": {"kind": "constant", "levels": [0.02, 0.04], "repetitions": 1}}
        made = {"version": 2, "name": "made", "renderers": ["point"], "orientation": "fixed", "stimuli": [ball],
                "blocks": [{**{key: value for key, value in block.items() if key not in ("level", "procedure")}, "repetitions": 1}],
                "groups": {"names": ["near", "far"], "assign": "balanced",
                           "patch": {"far": {"stimuli": [{"name": "ball", "shape": "cube", "edge_m": 0.05}]}}}}
        shown = self.pictures(made)
        self.assertEqual([(one.get("group"), one.get("written", ball)["shape"]) for one in shown], [(None, "sphere"), ("far", "cube")])
        made["blocks"] = [block]
        made["groups"]["patch"]["far"] = {"blocks": [other]}
        shown = self.pictures(made)
        self.assertEqual([(one.get("group"), [at["value"] for at in one.get("at", [])]) for one in shown],
                         [(None, []), (None, [0.03]), ("far", [0.04])])
        self.assertEqual([(range.get("group"), range["numbers"][0]["most"]) for range in shown[0]["varied"]], [(None, 0.03), ("far", 0.04)])

    def test_shapes_are_built_once_and_files_are_read_again(self):
        path = self.copy("size-questplus.json")
        self.design(path)
        text = path.read_text()

        def seconds(changed):
            began = time.monotonic()
            self.assertEqual(self.ask("check", text=changed)["faults"], [])
            return time.monotonic() - began
        first = seconds(text)  # 16 balls of 5,120 triangles with their search trees
        self.assertLess(min(seconds(text.replace('"title": "', f'"title": "{i} ')) for i in range(3)), 0.5 * first)
        values = json.loads(text)
        for one in values["stimuli"]:
            one.update(shape="mesh", file="part.stl")
            one.pop("radius_m")
        values["blocks"] = [{"name": "a", "task": "identify", "stimuli": ["standard", "comparison"], "repetitions": 1}]
        part = self.dir / "part.stl"
        part.write_bytes(cube_stl(0.05))
        self.assertEqual(self.ask("check", text=json.dumps(values))["faults"], [])
        part.write_bytes(cube_stl(0.05).replace(b"endsolid", b"facet", 1))
        self.assertNotEqual(self.ask("check", text=json.dumps(values))["faults"], [])

    def test_recovery_is_that_of_schedule(self):
        path = self.copy("size-questplus.json")
        self.design(path)
        mine = self.ask("recover", text=path.read_text(), block="size", participants=50)
        theirs = json.loads(subprocess.run([PALPATE, "schedule", path, "--recover", "50", "--format", "json"], capture_output=True, text=True,
                                           check=True, timeout=PATIENCE).stdout)
        self.assertEqual(mine["procedures"], theirs["procedures"])
        for block, words in (("practice", "do not follow the answers"), ("none", "do not follow the answers")):
            self.assertIn(words, self.ask("recover", 409, text=path.read_text(), block=block)["error"])
        self.assertIn("participants", self.ask("recover", 409, text=path.read_text(), block="size", participants=0)["error"])


class Data(DesignCase):
    """What the page says of data that the protocol's name has already."""

    def simulated(self, path, db, *options):
        subprocess.run([PALPATE, "simulate", path, "--db", self.dir / db, "--participants", "2", *options], check=True, capture_output=True, timeout=PATIENCE)

    def test_data_beside_the_protocol_are_found(self):
        path = self.copy("quick.json")
        (self.dir / "other.db").write_bytes(b"no database")
        self.simulated(path, "study.db")
        self.design(path)
        text = path.read_text()
        self.assertEqual(self.ask("data", text=text)["data"], [{"database": "study.db", "participants": 2, "simulated": True, "same": True}])
        (one,) = self.ask("data", text=text.replace('"seed": 1', '"seed": 2'))["data"]
        self.assertEqual((one["same"], one["only_texts"]), (False, False))
        self.assertIn("/seed", one["differs"])
        (one,) = self.ask("data", text=text.replace('"title": "', '"title": "New: '))["data"]
        self.assertTrue(one["only_texts"])
        (one,) = self.ask("data", text=text + "\n")["data"]
        self.assertEqual(one["differs"], "layout alone")
        self.assertEqual(self.ask("data", text=text.replace('"name": "quick"', '"name": "slow"'))["data"], [])
        before = sorted(one.name for one in self.dir.iterdir())
        self.ask("data", text=text)
        self.assertEqual(sorted(one.name for one in self.dir.iterdir()), before)  # looking leaves nothing

    def test_a_database_elsewhere_is_named(self):
        path = self.copy("quick.json")
        (self.dir / "far").mkdir()
        self.simulated(path, "far/lab.db")
        self.design(path, "--db", "far/lab.db")
        self.assertEqual([one["database"] for one in self.ask("data", text=path.read_text())["data"]], ["lab.db"])
        said = subprocess.run([PALPATE, "design", path, "--no-browser", "--db", self.dir / "none.db"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(said.returncode, 2, said.stderr)
        self.assertIn("none.db", said.stderr)


class Files(DesignCase):
    def test_saving_keeps_bytes_and_permissions(self):
        path = self.copy("ho2000.json")
        path.chmod(0o640)
        self.design(path)
        opened = self.ask("open")
        text = path.read_text(encoding="utf-8")
        self.assertEqual((opened["text"], opened["sha256"], opened["exists"]), (text, sha256(text), True))
        other = "\ufeff" + text.replace("\n", "\r\n").replace("2000", "18446744073709551615")
        self.assertEqual(self.ask("save", text=other, sha256=opened["sha256"]), {"sha256": sha256(other)})
        self.assertEqual(path.read_bytes(), other.encode())
        self.assertEqual(path.stat().st_mode & 0o777, 0o640)
        self.assertEqual(sorted(one.name for one in self.dir.iterdir()), ["p.json", "temporary"])

    def test_a_change_outside_is_not_overwritten(self):
        path = self.copy("quick.json")
        self.design(path)
        known = self.ask("open")["sha256"]
        path.write_text("theirs")
        refused = self.ask("save", 409, text="mine", sha256=known)
        self.assertEqual(refused["found"], {"text": "theirs", "sha256": sha256("theirs")})
        self.assertEqual(path.read_text(), "theirs")
        self.assertEqual(self.ask("copy", text="mine"), {"name": "p-2.json"})
        self.assertEqual(self.ask("copy", text="mine too"), {"name": "p-3.json"})
        self.assertEqual((self.dir / "p-2.json").read_text(), "mine")
        self.ask("save", text="mine", sha256=refused["found"]["sha256"])
        self.assertEqual(path.read_text(), "mine")

    def test_a_removed_file_is_not_made_again_unasked(self):
        path = self.copy("quick.json")
        self.design(path)
        known = self.ask("open")["sha256"]
        path.unlink()
        self.assertEqual(self.ask("save", 409, text="mine", sha256=known)["found"], {"text": "", "sha256": ""})
        self.assertFalse(path.exists())
        self.ask("save", text="mine", sha256="")
        self.assertEqual(path.read_text(), "mine")

    def test_protected_files_stay_as_they_are(self):
        path = self.copy("quick.json")
        before = path.read_bytes()
        self.design(path)
        path.chmod(0o444)
        self.assertEqual(self.ask("save", 409, text="mine", sha256=sha256(before.decode()))["error"], "The file is write-protected.")
        self.assertEqual(path.read_bytes(), before)

    def test_bytes_that_are_no_text_are_never_lost(self):
        path = self.copy("quick.json")
        self.design(path)
        known = self.ask("open")["sha256"]
        path.write_bytes(b'{"title": "M\xfcller"}')
        refused = self.ask("save", 409, text="mine", sha256=known)
        self.assertIn("UTF-8", refused["error"])
        self.assertNotIn("found", refused)
        self.assertEqual(path.read_bytes(), b'{"title": "M\xfcller"}')

    def test_links_stay_links(self):
        target = self.copy("quick.json", "real.json")
        link = self.dir / "p.json"
        link.symlink_to(target)
        self.design(link)
        self.ask("save", text="mine", sha256=self.ask("open")["sha256"])
        self.assertTrue(link.is_symlink())
        self.assertEqual(target.read_text(), "mine")

    def test_a_new_file_begins_with_templates(self):
        self.design("new.json")
        opened = self.ask("open")
        self.assertEqual((opened["exists"], opened["text"], opened["sha256"]), (False, "", ""))
        self.assertGreater(len(opened["templates"]), 10)
        for one in opened["templates"]:
            self.assertEqual(one["text"], (PROTOCOLS / f"{one['name']}.json").read_text(encoding="utf-8"))
            self.assertEqual(self.ask("check", text=one["text"])["faults"], [], one["name"])
        self.assertFalse((self.dir / "new.json").exists())
        self.ask("save", text="mine", sha256="")
        self.assertEqual((self.dir / "new.json").read_text(), "mine")

    def test_without_a_name_no_file_is_taken(self):
        (self.dir / "study.json").write_text("{}")
        process = subprocess.Popen([PALPATE, "design", "--no-browser"], cwd=self.dir, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        process.stdout.readline()
        self.assertIn("study-2.json", process.stderr.readline())

    def test_what_is_no_protocol_is_refused(self):
        long = self.dir / "long.json"
        long.write_bytes(b" " * (17 << 20))
        for name, text in (("scene.json", '{"objects": []}'), ("v3.json", '{"version": 3, "stimuli": []}'), ("texts.json", '{"texts.go": "Los"}'),
                           ("latin.json", b'{"version": 1, "title": "M\xfc"}'), ("p.txt", "{}"), ("none/p.json", None), ("long.json", None)):
            path = self.dir / name
            if text is not None:
                path.write_bytes(text if isinstance(text, bytes) else text.encode())
            done = subprocess.run([PALPATE, "design", path, "--no-browser"], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual(done.returncode, 2, name)
            self.assertIn(path.name, done.stderr)


def cube_stl(edge):
    """A closed cube as ASCII STL."""
    corners = [(x * edge, y * edge, z * edge) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    quads = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    facets = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    lines = ["solid cube"]
    for facet in facets:
        lines += ["facet normal 0 0 0", "outer loop", *("vertex %g %g %g" % corners[i] for i in facet), "endloop", "endfacet"]
    return "\n".join(lines + ["endsolid cube", ""]).encode()


class Beside(DesignCase):
    def mesh(self, name, content, status=200):
        return self.ask("mesh", status, name=name, bytes=base64.b64encode(content).decode())

    def test_meshes_are_copied_with_a_proposed_scale(self):
        self.design(self.copy("quick.json"))
        for edge, scale in ((0.05, 1), (50, 0.001), (2, 0.0254), (120000, 1e-7)):
            said = self.mesh("Part one.stl", cube_stl(edge))
            self.assertEqual(said["scale"], scale, edge)
            self.assertTrue(0.005 <= said["size_m"][0] <= 0.3, said)
            self.assertEqual((self.dir / said["file"]).read_bytes(), cube_stl(edge))
        self.assertEqual(sorted(one.name for one in self.dir.glob("*.stl")),
                         ["Part-one-2.stl", "Part-one-3.stl", "Part-one-4.stl", "Part-one.stl"])
        text = json.loads((self.dir / "p.json").read_text())
        text["stimuli"][0] = {"name": "sphere", "shape": "mesh", "file": "Part-one-2.stl", "scale": 0.001}
        self.assertEqual(self.ask("check", text=json.dumps(text))["faults"], [])
        picture = self.ask("picture", text=json.dumps(text))["stimuli"][0]
        self.assertAlmostEqual(picture["size_m"][0], 0.05, places=6)

    def test_long_meshes_come_in_parts(self):
        path = self.copy("quick.json")
        self.design(path)
        content = cube_stl(0.05) + b" " * (13 << 20)
        key = self.ask("upload")["upload"]
        for at in range(0, len(content), 8 << 20):
            sent = self.ask("part", upload=key, bytes=base64.b64encode(content[at:at + (8 << 20)]).decode())["bytes"]
        self.assertEqual(sent, len(content))
        self.assertEqual(self.ask("mesh", name="long.stl", upload=key)["file"], "long.stl")
        self.assertEqual((self.dir / "long.stl").read_bytes(), content)
        self.assertEqual(list(self.temporary.rglob("*.part")), [])
        for wrong in (key, "", "../p"):
            self.assertIn("upload", self.ask("mesh", 409, name="x.stl", upload=wrong)["error"])
            self.assertIn("upload", self.ask("part", 409, upload=wrong, bytes="")["error"])
        keys = [self.ask("upload")["upload"] for _ in range(3)]  # few at a time: the room is bounded
        self.assertEqual(sum(self.request("POST", "/part", json.dumps({"upload": one, "bytes": ""}), X_Palpate_Token=self.token)[0] == 200
                             for one in keys), 2)

    def test_solids_of_tetrahedra_are_soft(self):
        path = self.copy("quick.json")
        self.design(path)
        content = (pathlib.Path(__file__).resolve().parents[2] / "protocols" / "good" / "tetrahedra.msh").read_bytes()
        said = self.mesh("organ.msh", content)
        self.assertEqual(said["file"], "organ.msh")
        text = json.loads(path.read_text())
        text["stimuli"] = [{"name": "organ", "shape": "mesh", "file": "organ.msh", "soft": said["soft"], "scale": said["scale"]}]
        text["response"]["keys"] = {"1": "organ"}
        found = self.ask("check", text=json.dumps(text))["faults"]
        self.assertEqual([one for one in found if "organ.msh" in one["text"] or "soft" in one["pointer"]], [], found)
        self.assertTrue(self.mesh("bad.msh", b"$MeshFormat\n9 0 8\n", 409)["error"])

    def test_no_path_of_a_mesh_leads_elsewhere(self):
        self.design(self.copy("quick.json"))
        for name, kept in (("../../up.stl", "up.stl"), ("C:\\dir\\win.stl", "win.stl"), ("/etc/abs.stl", "abs.stl"), ("..hidden.stl", "hidden.stl"),
                           ("a\nb;rm.stl", "a-b-rm.stl"), ("p" * 300 + ".stl", "p" * 96 + ".stl")):
            self.assertEqual(self.mesh(name, cube_stl(0.05))["file"], kept)
            self.assertTrue((self.dir / kept).is_file())
        self.assertFalse((self.dir.parent / "up.stl").exists())

    def test_what_is_no_mesh_is_not_written(self):
        self.design(self.copy("quick.json"))
        open_box = b"\n".join(cube_stl(0.05).split(b"\n")[:-9]) + b"\nendsolid cube\n"
        for name, content in (("x.stl", b"not a mesh"), ("x.stl", b""), ("x.json", b"{}"), ("x.sh", b"#!"), ("x.stl", open_box), ("x.gltf", b"{}"), (".stl", b"x")):
            self.assertTrue(self.mesh(name, content, 409)["error"], name)
        self.assertIn("base64", self.ask("mesh", 409, name="x.stl", bytes="*")["error"])
        self.assertEqual(sorted(one.name for one in self.dir.iterdir()), ["p.json", "temporary"])
        self.assertEqual([one for one in self.temporary.rglob("*") if one.is_file() and not one.name.startswith("x")], [])

    def test_translations_are_files_of_their_own(self):
        path = self.copy("roughness-magnitude.json", "rough.json")
        shutil.copy(PROTOCOLS / "roughness-magnitude.texts.de.json", self.dir / "rough.texts.de.json")
        (self.dir / "rough.texts.not a language.json").write_text("{}")
        self.design(path)
        text = path.read_text(encoding="utf-8")
        said = self.ask("texts", text=text)
        self.assertEqual(said["languages"], ["de"])
        listed = subprocess.run([PALPATE, "validate", "--texts", path], capture_output=True, text=True, timeout=PATIENCE, check=True)
        self.assertEqual(dict(said["texts"]), json.loads(listed.stdout))
        german = self.ask("translation", language="de")
        self.assertEqual(german["text"], (self.dir / "rough.texts.de.json").read_text(encoding="utf-8"))
        self.assertEqual(self.ask("check_translation", text=text, language="de", translation=german["text"])["faults"], [])
        less = json.loads(german["text"])
        key = next(iter(less))
        del less[key]
        faults = self.ask("check_translation", text=text, language="de", translation=json.dumps(less))["faults"]
        self.assertEqual([one["pointer"] for one in faults], [f"/{key}"])
        self.assertEqual(self.ask("translation", language="pt-BR"), {"text": "", "sha256": ""})
        self.ask("save_translation", language="pt-BR", text="{}", sha256="")
        self.assertEqual((self.dir / "rough.texts.pt-BR.json").read_text(), "{}")
        refused = self.ask("save_translation", 409, language="pt-BR", text="{ }", sha256="")
        self.assertEqual(refused["found"]["text"], "{}")
        self.assertEqual(path.read_text(encoding="utf-8"), text)

    def test_a_language_is_no_path(self):
        self.design(self.copy("quick.json"))
        for language in ("", "d", "../../x", "de/x", "de.json", "deutsch", "de-", "a" * 30):
            self.ask("translation", 409, language=language)
            self.ask("save_translation", 409, language=language, text="{}", sha256="")
        self.assertEqual(sorted(one.name for one in self.dir.iterdir()), ["p.json", "temporary"])


class Rehearsals(DesignCase):
    def rehearse(self, name="quick.json", **more):
        self.ask("rehearse", text=(PROTOCOLS / name).read_text(encoding="utf-8"), **more)

    def wait(self):
        return self.until(lambda: (p := self.ask("progress"))["state"] != "running" and p)

    def test_a_rehearsal_ends_with_a_report(self):
        process = self.design(self.copy("quick.json"))
        self.assertEqual(self.ask("progress"), {"state": "none"})
        self.rehearse(participants=2)
        progress = self.wait()
        self.assertEqual((progress["state"], progress["recorded"]), ("done", 48), progress)
        status, headers, page = self.request("GET", "/report/" + progress["report"])
        self.assertEqual(status, 200)
        self.assertIn(b"SIMULATED", page)
        self.assertEqual(headers["Content-Security-Policy"], "sandbox allow-scripts allow-downloads")
        self.assertEqual([one.name for one in self.dir.iterdir() if one.suffix == ".db"], [])
        self.assertEqual(self.end(process), 0)
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_a_rehearsal_stops(self):
        self.design(self.copy("ho2000.json"))
        self.rehearse("ho2000.json", participants=40)
        self.assertIn("already", self.ask("rehearse", 409, text="{}")["error"])
        self.ask("stop")
        self.assertEqual(self.wait()["state"], "stopped")
        self.rehearse(participants=1)  # the next one is not held up
        self.assertEqual(self.wait()["state"], "done")

    def test_a_rehearsal_says_why_it_cannot_be(self):
        self.design(self.copy("quick.json"))
        text = (PROTOCOLS / "quick.json").read_text().replace('"radius_m": 0.03', '"radius_m": -3', 1)
        self.assertIn("/stimuli/0/radius_m", self.ask("rehearse", 409, text=text)["error"])
        self.assertEqual(self.ask("progress")["state"], "none")

    def test_a_killed_server_leaves_nothing(self):
        process = self.design(self.copy("ho2000.json"))
        self.rehearse("ho2000.json", participants=40)
        self.until(lambda: list(self.temporary.glob("*/*.db")))
        self.end(process, signal.SIGKILL)
        self.until(lambda: not list(self.temporary.iterdir()))
        self.assertEqual(sorted(one.name for one in self.dir.iterdir()), ["p.json", "temporary"])

    def test_signals_end_a_rehearsal(self):
        process = self.design(self.copy("ho2000.json"))
        self.rehearse("ho2000.json", participants=40)
        self.assertEqual(self.end(process, signal.SIGTERM), 0)
        self.assertEqual(list(self.temporary.iterdir()), [])

    def test_a_session_is_not_disturbed(self):
        self.design(self.copy("quick.json"))
        scene = self.dir / "scene.json"
        scene.write_text('{"objects": [{"shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 50}]}')
        session = subprocess.Popen([PALPATE, "serve", "--device", "simulated", "--scene", scene, "--rate", "100"], stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL, text=True)
        try:
            session.stdout.readline()
            error = self.ask("rehearse", 409, text=(PROTOCOLS / "quick.json").read_text())["error"]
            self.assertTrue(error.startswith("palpate serve runs on this computer"), error)
        finally:
            session.kill()
            session.communicate()
        self.rehearse(participants=1)
        self.assertEqual(self.wait()["state"], "done")

    def test_a_session_that_begins_ends_it(self):
        self.design(self.copy("ho2000.json"))
        self.rehearse("ho2000.json", participants=40)
        scene = self.dir / "scene.json"
        scene.write_text('{"objects": [{"shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 50}]}')
        session = subprocess.Popen([PALPATE, "serve", "--device", "simulated", "--scene", scene, "--rate", "100"], stdout=subprocess.DEVNULL,
                                   stderr=subprocess.DEVNULL)
        try:
            progress = self.wait()
            self.assertEqual((progress["state"], progress["why"]), ("stopped", "palpate serve has begun on this computer."))
        finally:
            session.kill()
            session.wait()

    def test_it_runs_below_others(self):
        process = self.design(self.copy("quick.json"))
        self.assertEqual(os.getpriority(os.PRIO_PROCESS, process.pid), min(19, os.getpriority(os.PRIO_PROCESS, 0) + 10))


if __name__ == "__main__":
    unittest.main()
