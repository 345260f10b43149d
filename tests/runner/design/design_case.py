"""A server of palpate design for the tests of this folder.

Their first arguments are PALPATE PROTOCOLS.
"""

import http.client
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse

PALPATE, PROTOCOLS = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
del sys.argv[1:3]
PATIENCE = 120  # s; only a hang reaches it


class DesignCase(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.dir = pathlib.Path(scratch.name)
        self.temporary = self.dir / "temporary"
        self.temporary.mkdir()

    def copy(self, name, to="p.json"):
        """A protocol of the repository in the test's folder."""
        shutil.copyfile(PROTOCOLS / name, self.dir / to)
        return self.dir / to

    def design(self, path, *options):
        """Starts a server of a file. \\return its process; address and token are in self"""
        process = subprocess.Popen([PALPATE, "design", path, "--no-browser", *options], stdout=subprocess.PIPE, cwd=self.dir,
                                   stderr=subprocess.PIPE, text=True, env={**os.environ, "TMPDIR": str(self.temporary)})

        def end():
            process.kill()
            process.communicate()
        self.addCleanup(end)
        line = process.stdout.readline().strip()
        if not line:
            process.wait(PATIENCE)
            self.fail(f"it does not serve, and ends with {process.returncode}: {process.stderr.read()}")
        self.address = line
        url = urllib.parse.urlsplit(line)
        self.port, self.token = url.port, url.fragment
        return process

    def request(self, method, target, body=None, **headers):
        """(status, headers, bytes) of a request; "_" in a header's name stands for "-"."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        try:
            connection.request(method, target, body, {name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def ask(self, message, status=200, **values):
        """The answer to a message of the page."""
        got, _, body = self.request("POST", "/" + message, json.dumps(values), X_Palpate_Token=self.token)
        self.assertEqual(got, status, body[:500])
        return json.loads(body)

    def until(self, what, *arguments):
        end = time.monotonic() + PATIENCE
        while not (found := what(*arguments)):
            self.assertLess(time.monotonic(), end, what)
            time.sleep(0.05)
        return found

    def end(self, process, sign=signal.SIGINT):
        process.send_signal(sign)
        return process.wait(PATIENCE)
