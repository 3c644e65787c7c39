"""Processor time of answers of a live page to requests of sliders, and what other servers would install.

    .venv/bin/python benchmarks/live.py [--packages]

Writes the tables of docs/live.md. With --packages pip is asked what panel and marimo would install.
"""

from __future__ import annotations

import http.client
import json
import re
import statistics
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path
from typing import Any

import psutil
from table import write_between

from seatfem.faces.live.server import LiveServer

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "live.md"
SCENES = {
    "valve_on_cast_iron": ("stopper.lift", "reed.thickness", "load.0.area"),
    "flapper_on_peek_sleeve": ("reed.release.tip_deflection", "contact.gap", "seat.damping_ratio"),
    "ball_on_seat": ("reed.velocity", "contact.gap", "seat.damping_ratio"),
}
"""Scenes of examples/, and sliders that are moved."""
TIMES = 5


def main() -> None:
    rows = [
        "| scene | processor time of an answer [s] | step over that of the full run |",
        "|---|---|---|",
    ]
    for scene, keys in SCENES.items():
        spent, longer = answers(ROOT / "examples" / f"{scene}.toml", keys)
        rows.append(f"| `examples/{scene}.toml` | {spent:.2f} | {longer:.0f} |")
    write_between(PAGE, "answers", "\n".join(rows))
    if "--packages" in sys.argv[1:]:
        words = (
            f"{name} would install {len(further(name))} packages that seatfem does not need"
            for name in ("panel", "marimo")
        )
        write_between(
            PAGE, "packages", f"{', '.join(words)}; the standard library's server installs none.".capitalize()
        )


def answers(scene: Path, keys: tuple[str, ...]) -> tuple[float, float]:
    """Return the median time of a processor for answers to moved sliders [s], and the longer step."""
    spent = list[float]()
    with tempfile.TemporaryDirectory() as folder:
        server = LiveServer(scene, {}, Path(folder) / "log.txt")
        threading.Thread(target=server.run, daemon=True).start()
        try:
            headers = {"X-Seatfem-Token": server.token}
            page = request(server, "GET", f"/?token={server.token}", headers)
            headers["Cookie"] = str(page.getheader("Set-Cookie")).partition(";")[0]
            lines = stream(request(server, "POST", "/answers", headers))
            first = [next(lines) for _ in range(2)]
            while {"sliders", "full"} - {each["kind"] for each in first}:
                first.append(next(lines))
            sliders = {each["key"]: each for message in first for each in message.get("sliders", ())}
            worker, values = psutil.Process(server.worker.pid), {}
            for number in range(TIMES * len(keys)):
                slider = sliders[keys[number % len(keys)]]
                middle = slider["number"] or slider["most"] / 2
                values[slider["key"]] = middle * (0.8 + 0.03 * number)
                before = sum(worker.cpu_times()[:2])
                request(server, "POST", "/values", headers, {"values": values})
                while next(lines)["kind"] != "answer":
                    pass
                spent.append(sum(worker.cpu_times()[:2]) - before)
        finally:
            server.server_close()
    longer = next(each["longer"] for each in first if each["kind"] == "full")
    return statistics.median(spent), longer


def request(
    server: LiveServer, way: str, place: str, headers: dict[str, str], body: Any = None
) -> http.client.HTTPResponse:
    """Return the response to a request of a page."""
    connection = http.client.HTTPConnection(server.hosts[0], timeout=600)
    further = {} if body is None else {"Content-Type": "application/json"}
    connection.request(way, place, body=None if body is None else json.dumps(body), headers=headers | further)
    return connection.getresponse()


def stream(response: http.client.HTTPResponse) -> Iterator[dict[str, Any]]:
    """Yield the answers."""
    while line := response.readline():
        yield json.loads(line)


def further(name: str) -> set[str]:
    """Return the packages that pip would install for one, less those that seatfem requires."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--dry-run",
        "--quiet",
        "--ignore-installed",
        "--report",
        "-",
        name,
    ]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return {plain(each["metadata"]["name"]) for each in report["install"]} - required("seatfem")


def required(name: str, known: set[str] | None = None) -> set[str]:
    """Return a package and all that it requires without extras."""
    known = set() if known is None else known
    if name not in known:
        known.add(name)
        try:
            lines = [line for line in requires(name) or () if "extra ==" not in line]
        except PackageNotFoundError:  # for another system
            lines = []
        for line in lines:
            required(plain(re.split(r"[^\w.-]", line)[0]), known)
    return known


def plain(name: str) -> str:
    """Return the name of a package as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


if __name__ == "__main__":
    main()
