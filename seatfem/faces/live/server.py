"""The server of a live page, by the standard library: this machine alone, one browser, all from memory.

It binds 127.0.0.1. The address of the page has a random token, without which nothing is answered; the first browser that
comes with it gets a cookie, and others are refused while its page is open. Each request must name this host (a foreign
name that resolves to 127.0.0.1 is refused) and, if it states an origin, this one. The page is one document that may load
nothing from elsewhere. It holds one response open, in which answers come line by line; when it breaks, the page was
closed, and the server ends.
"""

from __future__ import annotations

import json
import queue
import secrets
import socket
import socketserver
import sys
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from pathlib import Path
from select import select
from string import Template
from typing import Any, ClassVar, Final
from urllib.parse import parse_qs, urlsplit

from seatfem.faces.report.figures import part_of_page
from seatfem.jobs.processes import end_worker, start_worker, tell_worker

HOST: Final = "127.0.0.1"
HEADER: Final = "X-Seatfem-Token"
MOST_BYTES: Final = 20_000  # largest request
PING: Final = 0.5  # time between two looks whether the page is open [s]
GRACE: Final = 4.0  # time after which a closed page ends the server; less if it is only loaded again [s]
SLOWEST: Final = 10.0  # time within which a request must have come [s]
KEPT: Final = ("sliders", "full", "answer", "failed", "running", "computing")
"""Kinds of answers of which a page that is loaded again gets the last."""
SAFE: Final = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
}
ELSEWHERE: Final = "This live page is open in another window. Close that one first."
FOREIGN: Final = "Refused: open the address that seatfem live has printed."


class LiveServer(ThreadingHTTPServer):
    """Serves the page of one scene and passes requests and answers between it and the process that computes."""

    daemon_threads = True

    def __init__(self, scene: Path, changes: Mapping[str, object], log: Path) -> None:
        super().__init__((HOST, 0), _Handler)
        self.token = secrets.token_urlsafe(32)
        self.session = ""
        self.was_open = False
        self._page: socket.socket | None = None
        self._lock = threading.Lock()
        self._lines: queue.Queue[str] = queue.Queue()
        self._last: dict[str, str] = {}
        self._log = log
        start = json.dumps({"scene": str(scene.resolve()), "changes": dict(changes)})
        self.worker = start_worker("seatfem.faces.live.worker", start, log=log)

    def server_bind(self) -> None:
        """Bind the socket, without a look-up of the host's name."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    @property
    def address(self) -> str:
        """Return the address of the page, with its token."""
        return f"http://{HOST}:{self.server_port}/?token={self.token}"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Return the names under which this server may be addressed."""
        return f"{HOST}:{self.server_port}", f"localhost:{self.server_port}"

    def run(self) -> int:
        """Serve until the page is closed, or the worker has ended; return the worker's exit code, or 0."""
        for job in (self.serve_forever, self._pass_answers):
            threading.Thread(target=job, daemon=True).start()
        try:
            closed = 0.0
            while closed < GRACE:
                time.sleep(PING)
                closed = 0.0 if self.is_open or not self.was_open else closed + PING
                if (code := self.worker.poll()) is not None:
                    time.sleep(PING)  # the page is told first
                    return code
            return 0
        finally:
            self.shutdown()

    def server_close(self) -> None:
        """End the worker, and close the socket."""
        end_worker(self.worker)
        super().server_close()

    @property
    def is_open(self) -> bool:
        """Return whether a page holds its stream of answers open."""
        return self._page is not None and not _has_ended(self._page)

    def handle_error(self, request: object, client_address: object) -> None:
        """Print what went wrong with a request, unless its browser went away meanwhile."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]

    def ask(self, request: Mapping[str, Any]) -> None:
        """Pass a request to the worker."""
        with self._lock:
            tell_worker(self.worker, json.dumps(request))

    def begin_stream(self, page: socket.socket) -> bool:
        """Take a page as the one that gets the answers, and repeat the last ones; ``False`` if another is open."""
        with self._lock:
            if self.is_open:
                return False
            self._page, self.was_open, self._lines = page, True, queue.Queue()
            for line in self._last.values():
                self._lines.put(line)
        return True

    def next_line(self) -> str:
        """Return the next answer, "" if none comes in a while."""
        try:
            return self._lines.get(timeout=PING)
        except queue.Empty:
            return ""

    def _pass_answers(self) -> None:
        assert self.worker.stdout is not None
        for line in self.worker.stdout:
            self._pass(line)
        log = list[str]()
        with suppress(OSError):  # removed at the end
            log = self._log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        words = f"the process that computes has ended ({(log or ['no message'])[-1]}); start seatfem live again"
        self._pass(json.dumps({"kind": "ended", "words": words}) + "\n")

    def _pass(self, line: str) -> None:
        kind = json.loads(line)["kind"]
        with self._lock:
            if kind in KEPT:
                for over in ("running", "computing", "failed", "answer"):  # what a newer answer makes void
                    if kind != "sliders":
                        self._last.pop(over, None)
                self._last[kind] = line
            self._lines.put(line)


def _has_ended(connection: socket.socket) -> bool:
    """Return whether the other side has closed a connection."""
    try:
        return bool(select([connection], [], [], 0)[0]) and not connection.recv(1, socket.MSG_PEEK)
    except (OSError, ValueError):  # it is closed on this side, too
        return True


class _Handler(BaseHTTPRequestHandler):
    """One request: the page, its stream of answers, or values of sliders."""

    server: LiveServer
    server_version, sys_version = "seatfem", ""
    timeout: ClassVar[float] = SLOWEST

    def do_GET(self) -> None:
        place, server = urlsplit(self.path), self.server
        token = parse_qs(place.query).get("token", [""])[0]
        if not self._is_ours() or place.path != "/" or not _same(token, server.token):
            self._refuse(HTTPStatus.FORBIDDEN, FOREIGN)
            return
        if not server.session or not _same(self._cookie(), server.session):
            if server.is_open:
                self._refuse(HTTPStatus.CONFLICT, ELSEWHERE)
                return
            server.session = secrets.token_urlsafe(32)
        nonce = secrets.token_urlsafe(16)
        guard = (
            f"default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; "
            "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        own = {"live": _part("live.css"), "charts": _part("charts.js"), "live_js": _part("live.js")}
        own["style"] = part_of_page("style.css")
        page = Template(_part("page.html")).substitute(own, nonce=nonce, token=json.dumps(server.token))
        cookie = f"{self._cookie_name}={server.session}; HttpOnly; SameSite=Strict; Path=/"
        self._send(HTTPStatus.OK, page, "text/html", {"Content-Security-Policy": guard, "Set-Cookie": cookie})

    def do_POST(self) -> None:
        server = self.server
        known = _same(self.headers.get(HEADER, ""), server.token) and _same(self._cookie(), server.session)
        if not self._is_ours() or not known or not server.session:
            self._refuse(HTTPStatus.FORBIDDEN, FOREIGN)
        elif self.path == "/answers":
            self._stream()
        elif self.path == "/values":
            self._take_values()
        else:
            self._refuse(HTTPStatus.NOT_FOUND, "Nothing is here: reload the page.")

    def _is_ours(self) -> bool:
        """Return whether a request names this server, and a page of this server as its origin, if any."""
        origin, hosts = self.headers.get("Origin"), self.server.hosts
        return self.headers.get("Host") in hosts and (origin is None or origin.removeprefix("http://") in hosts)

    @property
    def _cookie_name(self) -> str:
        return f"seatfem-{self.server.server_port}"

    def _cookie(self) -> str:
        with suppress(CookieError):
            morsel = SimpleCookie(self.headers.get("Cookie", "")).get(self._cookie_name)
            return "" if morsel is None else morsel.value
        return ""

    def _stream(self) -> None:
        if not self.server.begin_stream(self.connection):
            self._refuse(HTTPStatus.CONFLICT, ELSEWHERE)
            return
        self.send_response(HTTPStatus.OK)
        for name, value in {**SAFE, "Content-Type": "application/x-ndjson"}.items():
            self.send_header(name, value)
        self.end_headers()
        with suppress(OSError):  # the page was closed
            while not _has_ended(self.connection):
                self.wfile.write((self.server.next_line() or "\n").encode("utf-8"))
        self.close_connection = True

    def _take_values(self) -> None:
        size = self.headers.get("Content-Length", "")
        if self.headers.get("Content-Type") != "application/json" or not size.isdecimal():
            self._refuse(HTTPStatus.BAD_REQUEST, "A request is JSON with its length: reload the page.")
            return
        if int(size) > MOST_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"More than {MOST_BYTES} bytes: reload the page.")
            return
        try:
            request = json.loads(self.rfile.read(int(size)))
            if not isinstance(request, dict):
                raise ValueError("no table")
        except (ValueError, RecursionError):
            self._refuse(HTTPStatus.BAD_REQUEST, "That is no JSON table: reload the page.")
            return
        self.server.ask({name: request[name] for name in ("values", "full", "number") if name in request})
        self._send(HTTPStatus.NO_CONTENT, "", "text/plain", {})

    def _refuse(self, status: HTTPStatus, words: str) -> None:
        self._send(status, words + "\n", "text/plain", {"Connection": "close"})

    def _send(self, status: HTTPStatus, text: str, kind: str, further: Mapping[str, str]) -> None:
        content = text.encode("utf-8")
        self.send_response(status)
        for name, value in {**SAFE, "Content-Type": f"{kind}; charset=utf-8", **further}.items():
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        """Print nothing: addresses have the token."""


def _same(one: str, other: str) -> bool:
    """Return whether two secrets are the same, in a time that does not tell how much of them is."""
    return secrets.compare_digest(one.encode("utf-8"), other.encode("utf-8"))


def _part(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
