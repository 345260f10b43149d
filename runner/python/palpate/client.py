"""Drives `palpate serve` from an experiment: scenes and answers go there, forces stay palpate's.

Needs nothing but Python; numpy for Client.samples().

    >>> with Client.from_token_file("token.json") as hand:
    ...     hand.start(renderer="ray", trial=1)
    ...     trial = hand.answer("cube")
    >>> trial["response_time_s"]
"""

import base64
import collections
import hashlib
import json
import os
import socket
import struct
import threading
import time
from typing import Any, Deque, Dict, List, Mapping, NamedTuple, Optional, Sequence, Union

__all__ = ["Client", "Clock", "ServeError"]

ALIVE_EVERY = 0.2  # s; the server waits for half a second
WIDTHS = {"tip": 3, "tail": 3, "force": 3, "rendered": 3, "contact": 3}  # columns; else one
MOST_ROWS = 600_000  # of a stream that nobody takes: ten minutes


class ServeError(RuntimeError):
    """The server refused a message, or has gone. `code` is for programs, `place` a JSON pointer."""

    def __init__(self, code: str, message: str, place: str = "", faults: Sequence[Mapping[str, str]] = ()) -> None:
        super().__init__(f"{code}: {message}" + (f" ({place})" if place else ""))
        self.code, self.message, self.place, self.faults = code, message, place, list(faults)


class Clock(NamedTuple):
    """The server's clock less time.monotonic_ns(), and how long the question took."""

    offset_ns: float
    round_trip_ns: int


class _Lines:
    """A message a line, over a Unix socket."""

    def __init__(self, path: str, time_out: float) -> None:
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(time_out)
        self.socket.connect(path)
        self.socket.settimeout(None)
        self.buffer = b""

    def send(self, text: str) -> None:
        self.socket.sendall(text.encode() + b"\n")

    def receive(self) -> Optional[str]:
        while b"\n" not in self.buffer:
            got = self.socket.recv(65536)
            if not got:
                return None
            self.buffer += got
        line, self.buffer = self.buffer.split(b"\n", 1)
        return line.decode()


class _WebSocket:
    """RFC 6455, as far as text messages of the loopback need it."""

    def __init__(self, url: str, time_out: float) -> None:
        if not url.startswith("ws://"):
            raise ValueError(f"expected ws://HOST:PORT, not {url!r}")
        host, _, port = url[5:].partition("/")[0].partition(":")
        self.socket = socket.create_connection((host, int(port)), timeout=time_out)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.sending = threading.Lock()
        self.buffer = b""
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
                            "Sec-WebSocket-Protocol: palpate.1\r\n\r\n".encode())
        while b"\r\n\r\n" not in self.buffer:
            got = self.socket.recv(4096)
            if not got:
                raise ServeError("closed", "the server closed the connection")
            self.buffer += got
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
        if not head.startswith(b"HTTP/1.1 101") or accept not in head:
            raise ServeError("closed", "no WebSocket: " + head.decode(errors="replace").splitlines()[0])
        self.socket.settimeout(None)

    def _frame(self, kind: int, data: bytes) -> None:
        size = len(data)
        head = bytes([0x80 | kind])
        if size < 126:
            head += bytes([0x80 | size])
        elif size < 65536:
            head += struct.pack("!BH", 0x80 | 126, size)
        else:
            head += struct.pack("!BQ", 0x80 | 127, size)
        mask = os.urandom(4)
        masked = (int.from_bytes(data, "big") ^ int.from_bytes((mask * (size // 4 + 1))[:size], "big")).to_bytes(size, "big")
        with self.sending:
            self.socket.sendall(head + mask + masked)

    def send(self, text: str) -> None:
        self._frame(1, text.encode())

    def _take(self, size: int) -> bytes:
        while len(self.buffer) < size:
            got = self.socket.recv(65536)
            if not got:
                raise ConnectionError
            self.buffer += got
        taken, self.buffer = self.buffer[:size], self.buffer[size:]
        return taken

    def receive(self) -> Optional[str]:
        whole = b""
        while True:
            first, second = self._take(2)
            size = second & 127
            if size == 126:
                size = struct.unpack("!H", self._take(2))[0]
            elif size == 127:
                size = struct.unpack("!Q", self._take(8))[0]
            data = self._take(size)
            kind = first & 15
            if kind == 8:
                return None
            if kind == 9:
                self._frame(10, data)
            elif kind in (0, 1):
                whole += data
                if first & 0x80:
                    return whole.decode()


class Client:
    """One connection. A thread of its own reads, and says every 200 ms that the program lives."""

    def __init__(self, url: Optional[str] = None, token: str = "", *, socket_path: Optional[str] = None,
                 role: str = "control", time_out: float = 10, keep_alive: bool = True) -> None:
        """`url` or `socket_path`: where `palpate serve` is. `time_out`: s, of each answer."""
        if (url is None) == (socket_path is None):
            raise ValueError("expected either url or socket_path")
        self._link: Union[_Lines, _WebSocket] = (
            _WebSocket(url, time_out) if url is not None else _Lines(str(socket_path), time_out))
        self._time_out = time_out
        self._sending = threading.Lock()
        self._changed = threading.Condition()
        self._number = 0
        self._replies: Dict[int, Dict[str, Any]] = {}
        self._awaited: set = set()
        self._events: Deque[Dict[str, Any]] = collections.deque(maxlen=10_000)
        self._rows: Deque[List[float]] = collections.deque(maxlen=MOST_ROWS)
        self._fields: Sequence[str] = ()
        self._gone = False
        self.dropped = 0  #: rows that the server left out because this program did not keep up
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            #: What the server said of itself.
            self.server = self.ask("hello", token=token, version=1, role=role)
        except BaseException:
            self._close()
            raise
        self._alive = threading.Thread(target=self._stay_alive, daemon=True)
        if keep_alive and role == "control":
            self._alive.start()

    @classmethod
    def from_token_file(cls, path: Union[str, "os.PathLike[str]"], **settings: Any) -> "Client":
        """With address and token from the file of `palpate serve --token-file`."""
        with open(path, encoding="utf-8") as file:
            said = json.load(file)
        return cls(said["url"], said["token"], **settings)

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        try:
            while True:
                text = self._link.receive()
                if text is None:
                    break
                self._take(json.loads(text))
        except (OSError, ConnectionError, ValueError):
            pass
        with self._changed:
            self._gone = True
            self._changed.notify_all()

    def _take(self, message: Dict[str, Any]) -> None:
        with self._changed:
            if "stream" in message:
                self._rows.extend(message["stream"])
                self.dropped += message["dropped"]
            elif "event" in message:
                self._events.append(message)
            elif message["re"] is None:
                self._events.append({"event": "refused", **message["error"]})
            elif message["re"] in self._awaited:
                self._replies[message["re"]] = message
            self._changed.notify_all()

    def _send(self, kind: str, awaited: bool, values: Mapping[str, Any]) -> int:
        with self._sending:
            self._number += 1
            number = self._number
            if awaited:
                with self._changed:
                    self._awaited.add(number)
            try:
                self._link.send(json.dumps({"id": number, "type": kind, **values}, allow_nan=False))
            except OSError as error:
                raise ServeError("closed", "the server has gone") from error
        return number

    def _stay_alive(self) -> None:
        while not self._gone:
            try:
                self._send("alive", False, {})
            except ServeError:
                return
            time.sleep(ALIVE_EVERY)

    def ask(self, kind: str, **values: Any) -> Dict[str, Any]:
        """Any message, and its answer. Raises ServeError where it is refused."""
        number = self._send(kind, True, values)
        with self._changed:
            came = self._changed.wait_for(lambda: number in self._replies or self._gone, self._time_out)
            self._awaited.discard(number)
            reply = self._replies.pop(number, None)
        if reply is None:
            raise ServeError("closed", "the server has gone") if came else ServeError("silent", "no answer came")
        if not reply["ok"]:
            raise ServeError(**reply["error"])
        return {key: value for key, value in reply.items() if key not in ("re", "ok")}

    def load(self, scene: Mapping[str, Any]) -> None:
        """A scene, as in scene.schema.json; every fault is in ServeError.faults."""
        self.ask("load", scene=scene)

    def start(self, renderer: str = "ray", trial: Optional[int] = None) -> int:
        """Forces on; returns their time in ns of the server's clock once they are."""
        more = {} if trial is None else {"trial": trial}
        return int(self.ask("start", renderer=renderer, **more)["t_ns"])

    def set(self, path: str, value: Any) -> None:
        """Changes the scene at a JSON pointer."""
        self.ask("set", path=path, value=value)

    def answer(self, response: str, t_ns: Optional[int] = None) -> Dict[str, Any]:
        """Ends the trial; what it was like: response_time_s, first_contact_s, missed_ticks and more."""
        return self.ask("answer", response=response, **({} if t_ns is None else {"t_ns": t_ns}))

    def stop(self, reason: str = "") -> Dict[str, Any]:
        """Forces off, without an answer."""
        return self.ask("stop", reason=reason)

    def mark(self, code: int, text: str = "") -> int:
        """An event for all clients; its time, ns."""
        return int(self.ask("mark", code=code, text=text)["t_ns"])

    def note(self, text: str) -> None:
        """Likewise, in words."""
        self.ask("note", text=text)

    def emergency(self) -> None:
        """Zero force at once, until clear()."""
        self.ask("emergency")

    def clear(self) -> None:
        """Allows forces again."""
        self.ask("clear")

    def clock(self, times: int = 10) -> Clock:
        """By the quickest of so many questions."""
        best: Optional[Clock] = None
        for _ in range(times):
            sent = time.monotonic_ns()
            reply = self.ask("clock")
            came = time.monotonic_ns()
            trip = came - sent - (reply["t_sent_ns"] - reply["t_received_ns"])
            offset = (reply["t_received_ns"] + reply["t_sent_ns"]) / 2 - (sent + came) / 2
            if best is None or trip < best.round_trip_ns:
                best = Clock(offset, trip)
        assert best is not None
        return best

    def subscribe(self, rate_hz: float = 250, fields: Sequence[str] = ("tip", "force")) -> None:
        """Has the server send rows of ticks from now on; 0 ends it."""
        self.ask("subscribe", rate_hz=rate_hz, fields=list(fields))
        with self._changed:
            self._fields = list(fields)
            self._rows.clear()
            self.dropped = 0

    def samples(self) -> Dict[str, Any]:
        """Rows since the last call, as numpy arrays: t_ns, tick and each field (n, or n x 3)."""
        import numpy

        with self._changed:
            rows, fields = list(self._rows), list(self._fields)
            self._rows.clear()
        out = {"t_ns": numpy.array([row[0] for row in rows], dtype=numpy.int64),
               "tick": numpy.array([row[1] for row in rows], dtype=numpy.int64)}
        column = 2
        for field in fields:
            width = WIDTHS.get(field, 1)
            values = numpy.array([row[column:column + width] for row in rows], dtype=float).reshape(len(rows), width)
            out[field] = values if width > 1 else values[:, 0]
            column += width
        return out

    def events(self) -> List[Dict[str, Any]]:
        """Events since the last call."""
        with self._changed:
            out = list(self._events)
            self._events.clear()
        return out

    def wait_for(self, event: str, time_out: float = 10) -> Dict[str, Any]:
        """The next event of that name; those before it are dropped. Raises TimeoutError."""
        end = time.monotonic() + time_out
        with self._changed:
            while True:
                while self._events:
                    came = self._events.popleft()
                    if came["event"] == event:
                        return came
                if self._gone:
                    raise ServeError("closed", "the server has gone")
                if not self._changed.wait(end - time.monotonic()):
                    raise TimeoutError(f"no event {event}")

    def _close(self) -> None:
        try:
            self._link.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self._reader.join(1)
        self._link.socket.close()

    def close(self) -> None:
        """Says goodbye: what is felt stops."""
        try:
            self.ask("bye")
        except ServeError:
            pass
        self._close()
