"""palpate devices --markers: the wiring of markers is tried. Usage: devices_markers_test.py PALPATE"""

import json
import os
import pty
import socket
import tty
import unittest

from command_case import CommandCase

KINDS = ["trial_start", "first_contact", "response", "time_out", "cut_off", "interval", "sync"]
CODES = [1, 2, 3, 4, 5, 6, 128]


class DevicesMarkers(CommandCase):
    def test_every_kind_of_marker_is_sent_to_every_receiver(self):
        master, slave = pty.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        tty.setraw(slave)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
            receiver.bind(("127.0.0.1", 0))
            done = self.palpate("devices", "--markers", f"serial:{os.ttyname(slave)}:9600:10", "--markers",
                                f"udp:127.0.0.1:{receiver.getsockname()[1]}")
            lines = [json.loads(receiver.recv(4096)) for _ in KINDS]
        self.assertEqual([line["marker"] for line in lines], KINDS)
        self.assertEqual([b - a for a, b in zip([l["time_ns"] for l in lines], [l["time_ns"] for l in lines][1:])
                          if not b - a >= 500_000_000], [])
        self.assertEqual(os.read(master, 100), bytes(byte for code in CODES for byte in (code, 0)))
        self.assertEqual([line.split()[:2] for line in done.stdout.splitlines()],
                         [[str(code), kind] for code, kind in zip(CODES, KINDS)])
        self.assertEqual(done.stdout.count("sent to"), 14)
        self.assertEqual([line["code"] for line in lines], CODES)

    def test_wrong_use_is_reported(self):
        self.assertIn("parport:PATH[:PULSE_MS]", self.palpate("devices", "--markers", "usb:1", status=2).stderr)
        self.assertIn("1 to 100 ms", self.palpate("devices", "--markers", "parport:/dev/null:200", status=2).stderr)
        self.assertIn("no parallel port", self.palpate("devices", "--markers", "parport:/dev/null", status=1).stderr)
        self.assertIn("--timing", self.palpate("devices", "--markers", "udp:127.0.0.1:9", "--timing", status=2).stderr)


unittest.main()
