"""Drives `palpate serve` from an experiment: scenes and answers go there, forces stay palpate's.

Needs nothing but Python; numpy for samples(). `Client` waits for each answer, as an experiment of PsychoPy does;
`AsyncClient` is the same for asyncio.

    >>> with Client.from_token_file("token.json") as hand:
    ...     hand.start(renderer="ray", trial=1)
    ...     trial = hand.answer("cube")
    >>> trial["response_time_s"]

    >>> async with await AsyncClient.from_token_file("token.json", role="watch") as eye:
    ...     await eye.subscribe(250, ("tip", "force"))
    ...     first = await eye.wait_for("first_contact")
"""

import asyncio
import base64
import collections
import hashlib
import json
import os
import socket
import struct
import sys
import threading
import time
from typing import (Any, Coroutine, Deque, Dict, Iterable, List, Mapping, NamedTuple, Optional, Sequence, Set, TextIO, Tuple,
                    TypeVar, Union)

__all__ = ["AsyncClient", "Client", "Clock", "ServeError"]

Path = Union[str, "os.PathLike[str]"]
T = TypeVar("T")

ALIVE_EVERY = 0.2  # s; the server waits for half a second
WIDTHS = {"tip": 3, "tail": 3, "force": 3, "rendered": 3, "contact": 3}  # columns; else one
MOST_ROWS = 600_000  # of a stream that nobody takes: ten minutes
START_TIME_OUT = 3600  # s, until the stylus is at home
CLOCK_WITHIN_NS = 1_000_000  # of the time of an answer
CLOCK_FOR_NS = 5_000_000_000  # the server takes two clocks for drifting apart
LONGEST_LINE = 4 << 20  # bytes


class ServeError(RuntimeError):
    """The server refused a message, or has gone. `code` is for programs, `place` a JSON pointer."""

    def __init__(self, code: str, message: str, place: str = "", faults: Sequence[Mapping[str, str]] = (),
                 stored: Optional[Mapping[str, Any]] = None) -> None:
        super().__init__(f"{code}: {message}" + (f" ({place})" if place else ""))
        self.code, self.message, self.place, self.faults = code, message, place, list(faults)
        self.stored = stored  #: of "timed-out": the trial as it is on record


class Clock(NamedTuple):
    """The server's clock less time.monotonic_ns(), and how long the question took."""

    offset_ns: float
    round_trip_ns: int


def _address(url: str) -> Tuple[str, int]:
    host, colon, port = url.partition("ws://")[2].partition("/")[0].rpartition(":")
    if not colon or not port.isdigit():
        raise ValueError(f"expected ws://HOST:PORT, not {url!r}")
    return host, int(port)


def _request(host: str, port: int) -> Tuple[bytes, bytes]:
    """What opens a WebSocket, and what the answer must hold."""
    key = base64.b64encode(os.urandom(16)).decode()
    accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
    return (f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: palpate.1\r\n\r\n").encode(), accept


def _check_response(head: bytes, accept: bytes) -> None:
    if not head.startswith(b"HTTP/1.1 101") or accept not in head:
        raise ServeError("closed", "no WebSocket: " + (head.decode(errors="replace").splitlines() or ["nothing came"])[0])


def _frame(kind: int, data: bytes) -> bytes:
    """RFC 6455, 5.2: whole, and masked as a client's must be."""
    size = len(data)
    head = bytes([0x80 | kind])
    if size < 126:
        head += bytes([0x80 | size])
    elif size < 65536:
        head += struct.pack("!BH", 0x80 | 126, size)
    else:
        head += struct.pack("!BQ", 0x80 | 127, size)
    mask = os.urandom(4)
    masked = int.from_bytes(data, "big") ^ int.from_bytes((mask * (size // 4 + 1))[:size], "big")
    return head + mask + masked.to_bytes(size, "big")


class _Frames:
    """Texts out of the bytes of a WebSocket, as far as the loopback needs it. `replies` are bytes to be sent."""

    def __init__(self, data: bytes = b"") -> None:
        self.data, self.whole, self.closed = bytearray(data), b"", False
        self.replies: List[bytes] = []

    def next(self) -> Optional[str]:
        """None where more bytes are needed, or where it is closed."""
        while not self.closed and len(self.data) >= 2:
            size, at = self.data[1] & 127, 2
            if size > 125:
                at, form = (4, "!H") if size == 126 else (10, "!Q")
                if len(self.data) < at:
                    return None
                size = struct.unpack(form, self.data[2:at])[0]
            if len(self.data) < at + size:
                return None
            kind, last, body = self.data[0] & 15, self.data[0] & 128, bytes(self.data[at:at + size])
            del self.data[:at + size]
            if kind == 8:
                self.closed = True
            elif kind == 9:
                self.replies.append(_frame(10, body))
            elif kind in (0, 1):
                self.whole += body
                if last:
                    text, self.whole = self.whole.decode(), b""
                    return text
        return None


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
    """Text messages over a WebSocket, each whole."""

    def __init__(self, url: str, time_out: float) -> None:
        host, port = _address(url)
        self.socket = socket.create_connection((host, port), timeout=time_out)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.sending = threading.Lock()
        request, accept = _request(host, port)
        self.socket.sendall(request)
        head, end, rest = b"", b"", b""
        while not end:
            got = self.socket.recv(4096)
            if not got:
                raise ServeError("closed", "the server closed the connection")
            head, end, rest = (head + got).partition(b"\r\n\r\n")
        _check_response(head, accept)
        self.socket.settimeout(None)
        self.frames = _Frames(rest)

    def _send(self, data: bytes) -> None:
        with self.sending:
            self.socket.sendall(data)

    def send(self, text: str) -> None:
        self._send(_frame(1, text.encode()))

    def receive(self) -> Optional[str]:
        while True:
            text = self.frames.next()
            while self.frames.replies:
                self._send(self.frames.replies.pop(0))
            if text is not None or self.frames.closed:
                return text
            got = self.socket.recv(65536)
            if not got:
                raise ConnectionError
            self.frames.data += got


class _Inbox:
    """What came and was not asked for: events, and rows of a stream."""

    def __init__(self) -> None:
        self._events: Deque[Dict[str, Any]] = collections.deque(maxlen=10_000)
        self._rows: Deque[List[float]] = collections.deque(maxlen=MOST_ROWS)
        self._fields: Sequence[str] = ()
        self._gone = False
        #: Rows that the server left out because this program did not keep up.
        self.dropped = 0
        #: What the server said of itself; with a protocol `record` has participant, session and what is stored.
        self.server: Dict[str, Any] = {}
        #: With a protocol: the trial that is due; None behind the last one.
        self.next: Optional[Dict[str, Any]] = None
        self.best_clock: Optional[Clock] = None  #: as clock() found it
        self._clock_asked = 0  # time.monotonic_ns()
        self._clock_seen: Optional[int] = None  # ns: when the server sent the newest answer of clock()

    def _take_next(self, said: Dict[str, Any]) -> Dict[str, Any]:
        if "record" in said:
            self.next = said["record"]["next"]
        elif "next" in said:
            self.next = said["next"]
        return said

    def _keep(self, message: Dict[str, Any]) -> None:
        if "stream" in message:
            self._rows.extend(message["stream"])
            self.dropped += message["dropped"]
        elif "event" in message:
            if message["event"] == "stored":  # also of a trial that timed out, which nobody has answered
                self._take_next(message)
            self._events.append(message)
        else:
            self._events.append({"event": "refused", **message["error"]})

    def _begin_stream(self, fields: Sequence[str]) -> None:
        self._fields = list(fields)
        self._rows.clear()
        self.dropped = 0

    def _take_event(self, wanted: Union[str, Sequence[str]]) -> Optional[Dict[str, Any]]:
        """The next one of that name, or of one of these; those before it are dropped."""
        names = (wanted,) if isinstance(wanted, str) else wanted
        while self._events:
            came = self._events.popleft()
            if came["event"] in names:
                return came
        return None

    def _take_rows(self) -> List[List[float]]:
        out = list(self._rows)
        self._rows.clear()
        if not out and self._gone:  # a program that asks for more in a loop must not ask for ever
            raise ServeError("closed", "the server has gone")
        return out

    def _take_events(self) -> List[Dict[str, Any]]:
        out = list(self._events)
        self._events.clear()
        if not out and self._gone:
            raise ServeError("closed", "the server has gone")
        return out


def _columns(rows: Sequence[Sequence[float]], fields: Sequence[str]) -> Dict[str, Any]:
    import numpy

    out = {"t_ns": numpy.array([row[0] for row in rows], dtype=numpy.int64),
           "tick": numpy.array([row[1] for row in rows], dtype=numpy.int64)}
    column = 2
    for field in fields:
        width = WIDTHS.get(field, 1)
        values = numpy.array([row[column:column + width] for row in rows], dtype=float).reshape(len(rows), width)
        out[field] = values if width > 1 else values[:, 0]
        column += width
    return out


def _answer_of(reply: Mapping[str, Any]) -> Dict[str, Any]:
    if not reply["ok"]:
        raise ServeError(**reply["error"], stored=reply.get("stored"))
    return {key: value for key, value in reply.items() if key not in ("re", "ok")}


def _given(**values: Any) -> Dict[str, Any]:
    """Without those that are left out."""
    return {key: value for key, value in values.items() if value is not None}


def _started(stimulus: Optional[str], renderer: Optional[str], trial: Optional[int], level: Optional[float],
             orientation_wxyz: Optional[Sequence[float]],
             intervals: Optional[Sequence[Mapping[str, Any]]]) -> Dict[str, Any]:
    turned = None if orientation_wxyz is None else [float(value) for value in orientation_wxyz]
    return _given(stimulus=stimulus, renderer=renderer, trial=trial, level=level, orientation_wxyz=turned,
                  intervals=None if intervals is None else [dict(interval) for interval in intervals])


def _check_clock(t_ns: Optional[int], best: Optional[Clock]) -> None:
    if t_ns is not None and (best is None or best.round_trip_ns > 2 * CLOCK_WITHIN_NS):
        raise ValueError("the server's clock is not known within 1 ms: ask clock() before a time is given")


def _is_stale(asked_ns: int) -> bool:
    """Two clocks that were compared then may have drifted apart by a part of a millisecond."""
    return time.monotonic_ns() - asked_ns > CLOCK_FOR_NS


def _closer(best: Optional[Clock], sent: int, came: int, reply: Mapping[str, Any]) -> Clock:
    """The better one of a clock that was measured before and this answer."""
    trip = came - sent - (reply["t_sent_ns"] - reply["t_received_ns"])
    offset = (reply["t_received_ns"] + reply["t_sent_ns"]) / 2 - (sent + came) / 2
    return best if best is not None and best.round_trip_ns <= trip else Clock(offset, trip)


class Client(_Inbox):
    """One connection. A thread of its own reads, and says every 200 ms that the program lives."""

    def __init__(self, url: Optional[str] = None, token: str = "", *, socket_path: Optional[str] = None,
                 role: str = "control", time_out: float = 10, keep_alive: bool = True) -> None:
        """`url` or `socket_path`: where `palpate serve` is. `time_out`: s, of each answer."""
        if (url is None) == (socket_path is None):
            raise ValueError("expected either url or socket_path")
        super().__init__()
        self._link: Union[_Lines, _WebSocket] = (
            _WebSocket(url, time_out) if url is not None else _Lines(str(socket_path), time_out))
        self._time_out = time_out
        self._sending = threading.Lock()
        self._changed = threading.Condition()
        self._number = 0
        self._replies: Dict[int, Dict[str, Any]] = {}
        self._awaited: Set[int] = set()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        try:
            self.server = self._take_next(self.ask("hello", token=token, version=1, role=role))
        except BaseException:
            self._close()
            raise
        self._alive = threading.Thread(target=self._stay_alive, daemon=True)
        if keep_alive and role == "control":
            self._alive.start()

    @classmethod
    def from_token_file(cls, path: Path, **settings: Any) -> "Client":
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
        finally:
            with self._changed:
                self._gone = True
                self._changed.notify_all()

    def _take(self, message: Dict[str, Any]) -> None:
        with self._changed:
            number = message.get("re")
            if number is None:
                self._keep(message)
            elif number in self._awaited:
                self._replies[number] = message
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
        return self._ask(kind, values)

    def _ask(self, kind: str, values: Mapping[str, Any], time_out: Optional[float] = None) -> Dict[str, Any]:
        number = self._send(kind, True, values)
        with self._changed:
            came = self._changed.wait_for(lambda: number in self._replies or self._gone,
                                          self._time_out if time_out is None else time_out)
            self._awaited.discard(number)
            reply = self._replies.pop(number, None)
        if reply is None:
            raise ServeError("closed", "the server has gone") if came else ServeError("silent", "no answer came")
        return _answer_of(reply)

    def load(self, scene: Mapping[str, Any]) -> None:
        """A scene, as in scene.schema.json; every fault is in ServeError.faults."""
        self.ask("load", scene=scene)

    def start(self, stimulus: Optional[str] = None, renderer: Optional[str] = None, trial: Optional[int] = None, *,
              level: Optional[float] = None, orientation_wxyz: Optional[Sequence[float]] = None,
              intervals: Optional[Sequence[Mapping[str, Any]]] = None, time_out: Optional[float] = None) -> int:
        """Forces on; returns their time in ns of the server's clock once they are.

        Of a scene `renderer` is "ray" where it is left out. With a protocol, `trial` must be the one that is due, and
        the rest is for blocks of the task "external"; forces begin once the stylus rests at home, for which this waits,
        at most `time_out` s (default: an hour). Where the block has several `intervals`, each is a mapping of
        stimulus, renderer, level and standard (whether the others are compared with it).
        """
        said = _started(stimulus, renderer, trial, level, orientation_wxyz, intervals)
        if time_out is None and "record" in self.server:
            time_out = START_TIME_OUT
        return int(self._ask("start", said, time_out)["t_ns"])

    def next_interval(self, time_out: Optional[float] = START_TIME_OUT) -> Dict[str, Any]:
        """On to the next interval of the trial; returns once its forces are on: t_ns, and which it is.

        The answer is due in the last one. Where the protocol limits the intervals (interval_limit_s) they follow by
        themselves, each with the event "interval", and the event "question" asks for the answer.
        """
        return self._ask("next", {}, time_out)

    def set(self, path: str, value: Any) -> None:
        """Changes the scene at a JSON pointer."""
        self.ask("set", path=path, value=value)

    def answer(self, response: str, t_ns: Optional[int] = None, correct: Optional[bool] = None) -> Dict[str, Any]:
        """Ends the trial; what it was like: response_time_s, first_contact_s, missed_ticks and more.

        With a protocol this returns once the trial is on record; `next` is what is due then, None behind the last one.
        Where the protocol's time was over before, it raises ServeError with the code "timed-out" and the trial as
        `stored`; the event "stored" has told it at that time.
        `t_ns`: when it was given, by the server's clock, which clock() must have measured within 1 ms; without it the
        server's time of arrival counts. `stamped` says which: "client" or "arrival". `correct`: of an external block; without it whether the response is the stimulus.
        """
        _check_clock(t_ns, self.best_clock)
        if t_ns is not None and _is_stale(self._clock_asked):
            self.clock(3)
        return self._take_next(self.ask("answer", response=response, **_given(t_ns=t_ns, correct=correct)))

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
        """Zero force at once, until clear() of this client or of a person at the server."""
        self.ask("emergency")

    def clear(self) -> None:
        """Allows forces again; for a person to say. Another client's emergency is refused with the code "emergency":
        the event "cleared" tells when it is over."""
        self.ask("clear")

    def clock(self, times: int = 10) -> Clock:
        """By the quickest of so many questions."""
        best: Optional[Clock] = None
        for _ in range(times):
            self._clock_asked = sent = time.monotonic_ns()
            reply = self.ask("clock", t_client=sent, **_given(t_seen_ns=self._clock_seen))
            best = _closer(best, sent, time.monotonic_ns(), reply)
            self._clock_seen = reply["t_sent_ns"]
        assert best is not None
        self.best_clock = best
        return best

    def subscribe(self, rate_hz: float = 250, fields: Sequence[str] = ("tip", "force")) -> None:
        """Has the server send rows of ticks from now on; 0 ends it."""
        self.ask("subscribe", rate_hz=rate_hz, fields=list(fields))
        with self._changed:
            self._begin_stream(fields)

    def samples(self) -> Dict[str, Any]:
        """Rows since the last call, as numpy arrays: t_ns, tick and each field (n, or n x 3).

        Raises ServeError once the server has gone and all rows were taken.
        """
        with self._changed:
            rows, fields = self._take_rows(), self._fields
        return _columns(rows, fields)

    def events(self) -> List[Dict[str, Any]]:
        """Events since the last call. Raises ServeError once the server has gone and all events were taken."""
        with self._changed:
            return self._take_events()

    def wait_for(self, event: Union[str, Sequence[str]], time_out: float = 10) -> Dict[str, Any]:
        """The next event of that name, or of one of these names; those before it are dropped. Raises TimeoutError."""
        end = time.monotonic() + time_out
        with self._changed:
            while True:
                came = self._take_event(event)
                if came is not None:
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


async def _within(work: Coroutine[Any, Any, T], time_out: float) -> T:
    """Its result. Raises TimeoutError.

    Not asyncio.wait_for: before Python 3.12 it drops a cancellation that comes together with the result, and the task
    that was to end goes on for ever.
    """
    task = asyncio.ensure_future(work)
    try:
        done, _ = await asyncio.wait([task], timeout=time_out)
        if not done:
            raise TimeoutError("the server does not answer")
        return task.result()
    finally:
        task.cancel()


class AsyncClient(_Inbox):
    """One connection, for asyncio: the methods of Client to be awaited. Made by connect or from_token_file."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, frames: Optional[_Frames],
                 time_out: float) -> None:
        """For connect(). `frames`: of a WebSocket; None: a message a line."""
        super().__init__()
        self._reader, self._writer, self._frames, self._time_out = reader, writer, frames, time_out
        self._number = 0
        self._loop = asyncio.get_running_loop()
        self._replies: Dict[int, "asyncio.Future[Dict[str, Any]]"] = {}
        self._news = self._loop.create_future()
        self._tasks = [asyncio.ensure_future(self._read())]

    @classmethod
    async def connect(cls, url: Optional[str] = None, token: str = "", *, socket_path: Optional[str] = None,
                      role: str = "control", time_out: float = 10, keep_alive: bool = True) -> "AsyncClient":
        """`url` or `socket_path`: where `palpate serve` is. `time_out`: s, of each answer."""
        if (url is None) == (socket_path is None):
            raise ValueError("expected either url or socket_path")
        frames = None
        if url is None:
            reader, writer = await _within(asyncio.open_unix_connection(socket_path, limit=LONGEST_LINE), time_out)
        else:
            host, port = _address(url)
            reader, writer = await _within(asyncio.open_connection(host, port), time_out)
            request, accept = _request(host, port)
            writer.write(request)
            try:
                _check_response(await _within(reader.readuntil(b"\r\n\r\n"), time_out), accept)
            except asyncio.IncompleteReadError as error:
                writer.close()
                raise ServeError("closed", "the server closed the connection") from error
            except BaseException:
                writer.close()
                raise
            frames = _Frames()
        made = cls(reader, writer, frames, time_out)
        try:
            made.server = made._take_next(await made.ask("hello", token=token, version=1, role=role))
        except BaseException:
            await made._close()
            raise
        if keep_alive and role == "control":
            made._tasks.append(asyncio.ensure_future(made._stay_alive()))
        return made

    @classmethod
    async def from_token_file(cls, path: Path, **settings: Any) -> "AsyncClient":
        """With address and token from the file of `palpate serve --token-file`."""
        with open(path, encoding="utf-8") as file:
            said = json.load(file)
        return await cls.connect(said["url"], said["token"], **settings)

    async def __aenter__(self) -> "AsyncClient":
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def _texts(self) -> Optional[List[str]]:
        """Those that came; None at the end."""
        if self._frames is None:
            line = await self._reader.readline()
            return [line.decode()] if line.endswith(b"\n") else None
        got = await self._reader.read(65536)
        self._frames.data += got
        out = []
        while (text := self._frames.next()) is not None:
            out.append(text)
        while self._frames.replies:
            self._writer.write(self._frames.replies.pop(0))
        return None if not got or self._frames.closed else out

    async def _read(self) -> None:
        try:
            while (texts := await self._texts()) is not None:
                for text in texts:
                    self._take(json.loads(text))
        except (OSError, ValueError):
            pass
        finally:
            self._gone = True
            for reply in self._replies.values():
                if not reply.done():
                    reply.cancel()
            self._tell_waiting()

    def _tell_waiting(self) -> None:
        news, self._news = self._news, self._loop.create_future()
        news.set_result(None)

    def _take(self, message: Dict[str, Any]) -> None:
        number = message.get("re")
        if number is not None:
            reply = self._replies.pop(number, None)
            if reply is not None and not reply.done():
                reply.set_result(message)
            return
        self._keep(message)
        if "stream" not in message:
            self._tell_waiting()

    def _send(self, kind: str, values: Mapping[str, Any]) -> int:
        if self._gone:
            raise ServeError("closed", "the server has gone")
        self._number += 1
        text = json.dumps({"id": self._number, "type": kind, **values}, allow_nan=False).encode()
        self._writer.write(text + b"\n" if self._frames is None else _frame(1, text))
        return self._number

    async def _stay_alive(self) -> None:
        while not self._gone:
            self._send("alive", {})
            await asyncio.sleep(ALIVE_EVERY)

    async def ask(self, kind: str, **values: Any) -> Dict[str, Any]:
        """Any message, and its answer. Raises ServeError where it is refused."""
        return await self._ask(kind, values)

    async def _ask(self, kind: str, values: Mapping[str, Any], time_out: Optional[float] = None) -> Dict[str, Any]:
        reply: "asyncio.Future[Dict[str, Any]]" = asyncio.get_running_loop().create_future()
        number = self._send(kind, values)
        self._replies[number] = reply
        done, _ = await asyncio.wait([reply], timeout=self._time_out if time_out is None else time_out)
        self._replies.pop(number, None)
        if not done:
            raise ServeError("silent", "no answer came")
        if reply.cancelled():
            raise ServeError("closed", "the server has gone")
        return _answer_of(reply.result())

    async def load(self, scene: Mapping[str, Any]) -> None:
        """As Client.load."""
        await self.ask("load", scene=scene)

    async def start(self, stimulus: Optional[str] = None, renderer: Optional[str] = None, trial: Optional[int] = None, *,
                    level: Optional[float] = None, orientation_wxyz: Optional[Sequence[float]] = None,
                    intervals: Optional[Sequence[Mapping[str, Any]]] = None, time_out: Optional[float] = None) -> int:
        """As Client.start."""
        said = _started(stimulus, renderer, trial, level, orientation_wxyz, intervals)
        if time_out is None and "record" in self.server:
            time_out = START_TIME_OUT
        return int((await self._ask("start", said, time_out))["t_ns"])

    async def next_interval(self, time_out: Optional[float] = START_TIME_OUT) -> Dict[str, Any]:
        """As Client.next_interval."""
        return await self._ask("next", {}, time_out)

    async def set(self, path: str, value: Any) -> None:
        """As Client.set."""
        await self.ask("set", path=path, value=value)

    async def answer(self, response: str, t_ns: Optional[int] = None, correct: Optional[bool] = None) -> Dict[str, Any]:
        """As Client.answer."""
        _check_clock(t_ns, self.best_clock)
        if t_ns is not None and _is_stale(self._clock_asked):
            await self.clock(3)
        return self._take_next(await self.ask("answer", response=response, **_given(t_ns=t_ns, correct=correct)))

    async def stop(self, reason: str = "") -> Dict[str, Any]:
        """As Client.stop."""
        return await self.ask("stop", reason=reason)

    async def mark(self, code: int, text: str = "") -> int:
        """As Client.mark."""
        return int((await self.ask("mark", code=code, text=text))["t_ns"])

    async def note(self, text: str) -> None:
        """As Client.note."""
        await self.ask("note", text=text)

    async def emergency(self) -> None:
        """As Client.emergency."""
        await self.ask("emergency")

    async def clear(self) -> None:
        """As Client.clear."""
        await self.ask("clear")

    async def clock(self, times: int = 10) -> Clock:
        """As Client.clock."""
        best: Optional[Clock] = None
        for _ in range(times):
            self._clock_asked = sent = time.monotonic_ns()
            reply = await self.ask("clock", t_client=sent, **_given(t_seen_ns=self._clock_seen))
            best = _closer(best, sent, time.monotonic_ns(), reply)
            self._clock_seen = reply["t_sent_ns"]
        assert best is not None
        self.best_clock = best
        return best

    async def subscribe(self, rate_hz: float = 250, fields: Sequence[str] = ("tip", "force")) -> None:
        """As Client.subscribe."""
        await self.ask("subscribe", rate_hz=rate_hz, fields=list(fields))
        self._begin_stream(fields)

    def samples(self) -> Dict[str, Any]:
        """As Client.samples."""
        return _columns(self._take_rows(), self._fields)

    def events(self) -> List[Dict[str, Any]]:
        """As Client.events."""
        return self._take_events()

    async def wait_for(self, event: Union[str, Sequence[str]], time_out: float = 10) -> Dict[str, Any]:
        """As Client.wait_for."""
        end = time.monotonic() + time_out
        while True:
            came = self._take_event(event)
            if came is not None:
                return came
            if self._gone:
                raise ServeError("closed", "the server has gone")
            # Not asyncio.wait_for, as in _within().
            done, _ = await asyncio.wait([self._news], timeout=max(0, end - time.monotonic()))
            if not done:
                raise TimeoutError(f"no event {event}")

    async def _close(self) -> None:
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        self._writer.close()

    async def close(self) -> None:
        """As Client.close."""
        try:
            await self.ask("bye")
        except ServeError:
            pass
        await self._close()


def pipe(hand: Client, lines: Iterable[str], out: TextIO) -> None:
    """Messages of a program that can start another one but has no WebSocket: a line each, answered by a line each.

    They need no `id`; {"type": "events"} and {"type": "samples"} are answered with what came since the last time.
    """
    print(json.dumps({"ok": True, **hand.server}), file=out, flush=True)
    for line in lines:
        try:
            said = json.loads(line)
            kind = said.pop("type")
            if kind == "events":
                answer: Dict[str, Any] = {"events": hand.events()}
            elif kind == "samples":
                answer = {name: values.tolist() for name, values in hand.samples().items()}
            elif kind == "subscribe":
                hand.subscribe(**said)
                answer = {}
            else:
                answer = hand._ask(kind, said, START_TIME_OUT if kind == "start" else None)
            print(json.dumps({"ok": True, **answer}), file=out, flush=True)
        except ServeError as error:
            refusal = {"code": error.code, "message": error.message, "place": error.place}
            late = {} if error.stored is None else {"stored": error.stored, "next": hand.next}
            print(json.dumps({"ok": False, "error": refusal, **late}), file=out, flush=True)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            refusal = {"code": "bad-message", "message": f"no message: {error}", "place": ""}
            print(json.dumps({"ok": False, "error": refusal}), file=out, flush=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: client.py TOKEN_FILE\nPasses messages of standard input on to palpate serve, a line each.")
    try:
        with Client.from_token_file(sys.argv[1]) as connected:
            pipe(connected, sys.stdin, sys.stdout)
    except (OSError, ServeError) as reason:
        sys.exit(f"{sys.argv[1]}: {reason}")
