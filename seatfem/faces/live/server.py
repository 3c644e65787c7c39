"""The server of a live page, by the standard library: this machine alone, one browser, all from memory.

It binds 127.0.0.1. The address of the page has a random token, without which nothing is answered. The first browser
that comes with it gets a cookie; others are refused while its page is open. Each request must name this host, so that a
foreign name that resolves to 127.0.0.1 is refused, and this origin if it states one. The page may load nothing from
elsewhere. It holds one response open, in which answers come line by line: when it breaks, the page was closed.
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
MOST_BYTES: Final = 20_000  # largest request
PING: Final = 0.5  # time between two looks whether the page is open [s]
GRACE: Final = 4.0  # time after which a closed page ends the server: it may only be loaded again [s]
MADE_VOID: Final = ("running", "computing", "failed", "answer")
"""Kinds of answers that a newer one makes void for a page that is loaded again, unlike "sliders" and "full"."""
SAFE: Final = {"Cache-Control": "no-store", "Referrer-Policy": "same-origin", "X-Content-Type-Options": "nosniff"}
GUARD: Final = (
    "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
PARTS: Final = ("live.css", "charts.js", "live.js")
ELSEWHERE: Final = "This live page is open in another window. Close that one first."
FOREIGN: Final = "Refused: open the address that seatfem live has printed."
NO_VALUES: Final = f"A request is a table in JSON of at most {MOST_BYTES} bytes: reload the page."


class LiveServer(ThreadingHTTPServer):
    """Serves the page of one scene and passes requests and answers between it and the process that computes."""

    daemon_threads = True

    def __init__(self, scene: Path, changes: Mapping[str, object], log: Path) -> None:
        super().__init__((HOST, 0), _Handler)
        names = (f"{host}:{self.server_port}" for host in (HOST, "localhost"))
        self.hosts, self.token, self.session = tuple(names), secrets.token_urlsafe(32), ""
        self.address = f"http://{self.hosts[0]}/?token={self.token}"
        self.lines: queue.Queue[str] = queue.Queue()
        self._page: socket.socket | None = None
        self._lock, self._last, self._log = threading.Lock(), dict[str, str](), log
        start = json.dumps({"scene": str(scene.resolve()), "changes": dict(changes)})
        self.worker = start_worker("seatfem.faces.live.worker", start, log=log)

    def server_bind(self) -> None:
        """Bind the socket, without a look-up of the host's name."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    def run(self) -> int:
        """Serve until the page is closed, or the worker has ended; return the worker's exit code, or 0."""
        for job in (self.serve_forever, self._pass_answers):
            threading.Thread(target=job, daemon=True).start()
        closed = 0.0
        try:
            while closed < GRACE:
                time.sleep(PING)
                closed = 0.0 if self._page is None or self.is_open else closed + PING
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

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print what went wrong with a request, unless its browser went away meanwhile."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    @property
    def is_open(self) -> bool:
        """Return whether a page holds its stream of answers open."""
        return self._page is not None and not _has_ended(self._page)

    def ask(self, request: Mapping[str, Any]) -> None:
        """Pass a request to the worker."""
        with self._lock:
            tell_worker(self.worker, json.dumps(request))

    def begin_stream(self, page: socket.socket) -> bool:
        """Take a page as the one that gets the answers, and repeat the last ones; ``False`` if another is open."""
        with self._lock:
            if self.is_open:
                return False
            self._page, self.lines = page, queue.Queue()
            for line in self._last.values():
                self.lines.put(line)
        return True

    def _pass_answers(self) -> None:
        assert self.worker.stdout is not None
        for line in self.worker.stdout:
            self._pass(line)
        with suppress(OSError):  # it is removed at the end
            log = self._log.read_text(encoding="utf-8", errors="replace").strip().splitlines() or ["no message"]
            words = f"the process that computes has ended ({log[-1]}); start seatfem live again"
            self._pass(json.dumps({"kind": "ended", "words": words}) + "\n")

    def _pass(self, line: str) -> None:
        kind = json.loads(line)["kind"]
        with self._lock:
            if kind == "full" or kind in MADE_VOID:
                for each in MADE_VOID:
                    self._last.pop(each, None)
            if kind in ("sliders", "full", *MADE_VOID):
                self._last[kind] = line
            self.lines.put(line)


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
    timeout: ClassVar[float] = 10.0  # within which a request must have come [s]

    def do_GET(self) -> None:
        place, server = urlsplit(self.path), self.server
        token = parse_qs(place.query).get("token", [""])[0]
        if not self._is_ours(token) or place.path != "/":
            self._send(HTTPStatus.FORBIDDEN, FOREIGN)
            return
        if not self._has_cookie():
            if server.is_open:
                self._send(HTTPStatus.CONFLICT, ELSEWHERE)
                return
            server.session = secrets.token_urlsafe(32)
        nonce, own = secrets.token_urlsafe(16), {name.replace(".", "_"): _part(name) for name in PARTS}
        values = {"style": part_of_page("style.css"), "nonce": nonce, "token": json.dumps(server.token)}
        # "Lax": to load a page again counts as an errand of the file that has led to it
        cookie = f"{self._cookie_name}={server.session}; HttpOnly; SameSite=Lax; Path=/"
        headers = {"Content-Security-Policy": GUARD.format(nonce=nonce), "Set-Cookie": cookie}
        self._send(HTTPStatus.OK, Template(_part("page.html")).substitute(own, **values), "text/html", headers)

    def do_POST(self) -> None:
        if not self._is_ours(self.headers.get("X-Seatfem-Token", "")) or not self._has_cookie():
            self._send(HTTPStatus.FORBIDDEN, FOREIGN)
        elif self.path == "/answers":
            self._stream()
        elif (request := self._request()) is None:
            self._send(HTTPStatus.BAD_REQUEST, NO_VALUES)
        else:
            self.server.ask({name: request[name] for name in ("values", "full", "number") if name in request})
            self._send(HTTPStatus.NO_CONTENT, "")

    def _is_ours(self, token: str) -> bool:
        """Return whether a request has the token, and names this server, and no other as its origin."""
        origin, hosts = self.headers.get("Origin"), self.server.hosts
        is_here = self.headers.get("Host") in hosts and (origin is None or origin.removeprefix("http://") in hosts)
        return is_here and secrets.compare_digest(token.encode(), self.server.token.encode())

    @property
    def _cookie_name(self) -> str:
        return f"seatfem-{self.server.server_port}"

    def _has_cookie(self) -> bool:
        with suppress(CookieError):
            morsel = SimpleCookie(self.headers.get("Cookie", "")).get(self._cookie_name)
            known = self.server.session.encode()
            return morsel is not None and known != b"" and secrets.compare_digest(morsel.value.encode(), known)
        return False

    def _request(self) -> dict[str, Any] | None:
        size = self.headers.get("Content-Length", "")
        is_json = self.headers.get("Content-Type") == "application/json"
        if self.path != "/values" or not is_json or not size[:9].isdecimal() or int(size[:9]) > MOST_BYTES:
            return None
        with suppress(ValueError, RecursionError):
            request = json.loads(self.rfile.read(int(size)))
            return request if isinstance(request, dict) else None
        return None

    def _stream(self) -> None:
        if not self.server.begin_stream(self.connection):
            self._send(HTTPStatus.CONFLICT, ELSEWHERE)
            return
        self._begin(HTTPStatus.OK, {"Content-Type": "application/x-ndjson"})
        while not _has_ended(self.connection):
            with suppress(queue.Empty):
                self.wfile.write(self.server.lines.get(timeout=PING).encode())

    def _send(self, status: HTTPStatus, text: str, kind: str = "text/plain", further: Mapping[str, str] = SAFE) -> None:
        content = text.encode()
        self._begin(status, {"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(content)), **further})
        self.wfile.write(content)

    def _begin(self, status: HTTPStatus, headers: Mapping[str, str]) -> None:
        self.send_response(status)
        for name, value in (SAFE | dict(headers)).items():
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Print nothing: addresses have the token."""


def _part(name: str) -> str:
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
