"""A live page: who is let in, what its sliders answer, what it writes, and that nothing is left of it."""

import http.client
import json
import os
import signal
import subprocess
import sys
import threading
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import psutil
import pytest

from seatfem.faces.live.quick import Reference, march_of, reference_of, with_bars
from seatfem.faces.live.sliders import LiveError, Slider, candidates, changed_file, taken
from seatfem.faces.live.worker import Session, Superseded
from seatfem.structures.cache import Cache, build
from tests.browsing import put, until
from tests.gallery import write_scene
from tests.steps import BAD_INPUT, load_scene, run_command, run_scene, silent

ROOT = Path(__file__).parents[2]
SCENE = """\
# what a test computes in a moment; INVENTED
title = "Mass on a <block>"

[seat]
kind = "block"
width = "8 mm"
depth = "8 mm"
thickness = "8 mm"
patch_width = "4 mm"
patch_depth = "4 mm"
material = { young = "200 GPa", density = "7850 kg/m^3" }
mesh = { size = "4 mm", contact_size = "4 mm" }
damping_ratio = 0.02
greens = { bandwidth = "100 kHz", tolerance = 0.05, method = "krylov" }

[reed]
kind = "rigid_mass"
mass = "1 g"                            # of the INVENTED striker
velocity = "-1 m/s"

[run]
duration = "60 us"
time_step = "50 ns"

[accuracy]
target = "40 %"
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path, SCENE)


@contextmanager
def serving(scene: Path, browser: str = "") -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Yield the program that serves a scene, and the address that it prints; ``browser``: command that it opens."""
    command = [sys.executable, "-m", "seatfem", "live", str(scene), *([] if browser else ["--no-browser"])]
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | ({"BROWSER": browser} if browser else {})
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=scene.parent, env=environment, text=True) as program:
        try:
            assert program.stdout is not None
            yield program, program.stdout.readline().strip()
        finally:
            program.kill()


class Client:
    """A browser without a screen: it keeps its cookie, and reads the answers."""

    def __init__(self, address: str) -> None:
        place = urlsplit(address)
        self.host, self.token, self.cookie = place.netloc, place.query.partition("=")[2], ""

    def ask(self, way: str, place: str, body: object = None, **headers: str) -> http.client.HTTPResponse:
        """Return the response to a request with the headers of a page, in which some are replaced."""
        usual = {"Host": self.host, "Cookie": self.cookie, "X-Seatfem-Token": self.token}
        content = None if body is None else body if isinstance(body, str) else json.dumps(body)
        usual |= {} if content is None else {"Content-Type": "application/json"}
        connection = http.client.HTTPConnection(self.host, timeout=60)
        replaced = {name.replace("_", "-"): value for name, value in headers.items()}
        connection.request(way, place, body=content, headers=usual | replaced)
        return connection.getresponse()

    def enter(self) -> http.client.HTTPResponse:
        """Open the page, and keep its cookie."""
        response = self.ask("GET", f"/?token={self.token}")
        self.cookie = (response.getheader("Set-Cookie") or "").partition(";")[0]
        return response


def of_kind(answers: http.client.HTTPResponse, *kinds: str) -> Mapping[str, Any]:
    """Return the next answer of one of these kinds."""
    while line := answers.readline():
        if (message := json.loads(line))["kind"] in kinds:
            return dict(message)
    raise AssertionError(f"no {kinds}")


def ended(program: subprocess.Popen[str], children: list[psutil.Process]) -> int:
    """Return the exit code of the program, of which no process is left."""
    code = program.wait(timeout=60)
    _, alive = psutil.wait_procs(children, timeout=20)
    assert alive == []
    return code


@pytest.mark.slow
def test_one_browser_of_this_machine_is_let_in(scene: Path) -> None:
    """Nothing is answered without the token, under another name, from another origin and beside an open page."""
    with serving(scene) as (program, address):
        first, second = Client(address), Client(address)
        page = f"/?token={first.token}"
        assert first.host.startswith("127.0.0.1:")
        family = [each.laddr.ip for each in psutil.Process(program.pid).net_connections() if each.status == "LISTEN"]
        assert family == ["127.0.0.1"]
        for place, headers in (
            ("/", {}),
            ("/?token=guessed", {}),
            ("/live.js", {}),
            (page, {"Host": "rebound.example:80"}),
            (page, {"Origin": "http://elsewhere.example"}),
            (page, {"Origin": "null"}),
        ):
            assert first.ask("GET", place, **headers).status == 403, (place, headers)
        assert first.ask("POST", "/answers").status == 403  # the page was not opened
        response = first.enter()
        shown = response.read().decode()
        assert response.status == 200
        assert "default-src 'none'" in str(response.getheader("Content-Security-Policy"))
        assert "http" not in shown.replace("http://www.w3.org/2000/svg", "").replace("http-equiv", "")
        for wrong in ({"X_Seatfem_Token": "guessed"}, {"Cookie": ""}, {"Origin": "http://elsewhere.example"}):
            assert first.ask("POST", "/values", {"values": {}}, **wrong).status == 403, wrong
        answers = first.ask("POST", "/answers")
        assert answers.status == 200
        assert second.enter().status == 409  # the address alone is not enough
        assert first.ask("POST", "/answers").status == 409  # nor is a second window of the same browser
        for body in ("{", "[]", "[" * 3000, json.dumps({"values": "x" * 30_000})):
            assert first.ask("POST", "/values", body).status == 400, body[:20]
        of_kind(answers, "full")
        for values in ({"seat.kind": 1.0}, {"reed.mass": 1e9}, {"reed.mass": "1 g"}, {"reed.mass": float("nan")}):
            assert first.ask("POST", "/values", {"values": values}).status == 204
            words = of_kind(answers, "failed", "answer")["words"]
            assert "reload the page" in words or "choose a value within" in words
        children = psutil.Process(program.pid).children(recursive=True)
        assert children
        answers.close()
        assert ended(program, children) == 0


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_a_signal_ends_all_of_it(scene: Path, number: signal.Signals, code: int) -> None:
    with serving(scene) as (program, address):
        client = Client(address)
        client.enter()
        of_kind(client.ask("POST", "/answers"), "progress")
        children = psutil.Process(program.pid).children(recursive=True)
        assert children
        program.send_signal(number)
        assert ended(program, children) == code


@pytest.mark.slow
def test_a_page_in_a_browser(scene: Path, chromium: Any) -> None:
    """Opened, moved, answered, computed again, in full, loaded again, closed."""
    script, opened = scene.with_name("browser"), scene.with_name("opened.html")
    script.write_text(f'#!/bin/sh\nprintf %s "$1" > {scene.with_name("asked")}\ncp "${{1#file://}}" {opened}\n')
    script.chmod(0o700)
    with serving(scene, str(script)) as (program, address):
        until(opened.is_file, "a browser was opened")
        assert address.partition("=")[2] not in scene.with_name("asked").read_text()  # nobody sees it among processes
        chromium.get(opened.as_uri())
        until(lambda: chromium.find_elements("css selector", "#state"), "it leads to the page")

        def state() -> str:
            return str(chromium.find_element("css selector", "#state").text)

        def value() -> str:
            return str(chromium.find_element("css selector", "#rows").text)

        until(lambda: state().startswith("computed in full: Decision: "), "the first full run")
        assert chromium.find_element("css selector", "h1").text == "Mass on a <block>"
        quick = chromium.find_elements("css selector", "#quick input")
        assert {"reed.velocity", "reed.mass", "contact.gap"} <= {each.get_attribute("name") for each in quick}
        (thickness,) = chromium.find_elements("css selector", "#slow input[name='seat.thickness']")
        assert len(chromium.find_elements("css selector", "#force path")) == 2  # seat and spring
        before = value()
        put(chromium, next(each for each in quick if each.get_attribute("name") == "reed.velocity"), "50")
        until(lambda: state().startswith("answered by") and value() != before, "an answer to the speed")
        assert "last full run's uncertainty" in chromium.find_element("css selector", "#verdict").text
        before = value()
        chromium.execute_script(
            "window.states = new Set(); const state = document.querySelector('#state');"
            "new MutationObserver(() => states.add(state.textContent)).observe(state, { childList: true })"
        )
        put(chromium, thickness, "-60")
        until(lambda: "bodies computed again" in state() and value() != before, "an answer to the thickness")
        assert "computing" in chromium.execute_script("return [...states]")
        chromium.find_element("css selector", "#full").click()
        until(lambda: state().startswith("computed in full"), "a full run")
        assert scene.with_name("scene-live-1.toml").is_file()
        shown = value()
        chromium.refresh()  # the same browser may load it again, and sees what was there
        until(lambda: state().startswith("computed in full") and value() == shown, "the page again")
        moved = chromium.find_elements("css selector", "label.moved input")
        assert {each.get_attribute("name") for each in moved} == {"reed.velocity", "seat.thickness"}
        for width in (1300, 400):
            size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
            chromium.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            assert chromium.execute_script("return document.documentElement.scrollWidth") <= width
        chromium.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        requested = chromium.execute_script("return performance.getEntriesByType('resource').map(e => e.name)")
        assert {urlsplit(each).netloc for each in requested} <= {urlsplit(address).netloc}
        chromium.switch_to.new_window("tab")
        chromium.get(address)
        until(lambda: "open in another window" in state(), "a second window is refused")
        chromium.close()
        chromium.switch_to.window(chromium.window_handles[0])
        children = psutil.Process(program.pid).children(recursive=True)
        chromium.get("about:blank")
        assert ended(program, children) == 0


@pytest.fixture(scope="module")
def full_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Reference]:
    """Return a scene and its full run."""
    folder = tmp_path_factory.mktemp("live")
    path = write_scene(folder, SCENE)
    outcome = run_scene(path, folder / "result", silent, pictures=False)
    assert outcome.plan is not None
    return path, reference_of(outcome.plan, outcome.summary, Cache(folder / "result" / "seat.h5"), silent)


@pytest.mark.slow
@pytest.mark.parametrize(
    "change", [{"reed.velocity": "-1.5 m/s"}, {"reed.mass": "0.7 g"}, {"seat.damping_ratio": 0.035}]
)
def test_a_quick_answer_is_that_of_a_full_run(
    full_run: tuple[Path, Reference], change: Mapping[str, object], tmp_path: Path
) -> None:
    """The same method gives the same number, but for round-off and the longer step, which is in the bar told."""
    path, known = full_run
    changed = load_scene(path, change)
    assert known.is_quick(changed)
    numbers, _ = march_of(known, changed, silent)
    summary = with_bars(known, numbers, is_known=True)
    full = run_scene(changed, tmp_path, silent, pictures=False, plan=known.plan_for(changed)).summary
    for key in ("landing_filtered_peak_force_N", "landing_impulse_Ns", "spring_landing_impulse_Ns"):
        value, exact = float(str(summary[key])), float(str(full[key]))
        bar = summary.get(f"error_bar_{key.removeprefix('spring_')}")
        assert abs(value - exact) <= 0.1 * float(str(bar)), key
        if "spring" not in key:  # it is not the answer of the run before
            assert abs(float(str(known.summary[key])) - exact) > 5 * abs(value - exact), key


@pytest.mark.slow
def test_damping_is_added_to_known_modes(full_run: tuple[Path, Reference]) -> None:
    """The response with another damping ratio is that of a body solved with it, as far as the tolerance of both allows:
    the vectors of the reduction depend on damping. Another thickness is no damping."""
    path, known = full_run
    damped, thicker = (load_scene(path, each) for each in ({"seat.damping_ratio": 0.05}, {"seat.thickness": "9 mm"}))
    method, duration = known.plan.method.seat, damped.run.duration
    solved = known.seat.solved_for(damped.seat, method)
    assert solved is not None
    exact = build(damped.seat, method, duration).greens
    time, tolerance = np.linspace(0, duration, 500), 0.05  # of g, seat.greens.tolerance
    response, plain = exact.step_response(time), known.seat.solved.greens.step_response(time)
    off, off_before = (np.abs(each - response).max() for each in (solved.greens.step_response(time), plain))
    assert off < tolerance * np.abs(response).max()
    assert off < off_before / 3
    assert known.seat.solved_for(thicker.seat, method) is None
    assert not known.is_quick(thicker)


def test_sliders_follow_from_the_tables(scene: Path) -> None:
    """Quantities of the problem have sliders, also a gap that is not stated; those of the method have none."""
    data = tomllib.loads(SCENE)
    sliders = {each.key: each for each in candidates(data, load_scene(scene))}
    assert {"seat.thickness", "seat.material.young", "reed.mass", "reed.velocity", "contact.gap"} <= sliders.keys()
    assert not [key for key in sliders if key.startswith(("run", "accuracy", "seat.mesh", "seat.greens"))]
    speed, gap = sliders["reed.velocity"], sliders["contact.gap"]
    assert (speed.least, speed.most, speed.unit) == (-2.0, -0.5, "m/s")
    assert gap.number == gap.least == 0 < gap.most
    assert speed.written(-1.23456) == "-1.235 m/s"
    with pytest.raises(LiveError, match=r"reed.velocity: -3 is outside -2 to -0.5 m/s; choose"):
        speed.written(-3.0)
    close = taken(scene, {}, speed)
    assert close is not None
    assert close.reed.velocity == pytest.approx(-0.99)
    assert taken(scene, {}, Slider("seat.kind", 1.0, "mm", 0.5, 2.0)) is None


@pytest.mark.parametrize(
    ("key", "value", "line"),
    [
        ("reed.mass", "2 g", 'mass = "2 g"                            # of the INVENTED striker'),
        ("seat.damping_ratio", 0.03, "damping_ratio = 0.03"),
        ("seat.material.young", "190 GPa", 'material = { young = "190 GPa", density = "7850 kg/m^3" }'),
        ("reed.law", "x", 'law = "x"'),
        ("contact.gap", "0.01 mm", '[contact]\ngap = "0.01 mm"'),
    ],
)
def test_a_changed_scene_keeps_its_other_lines(scene: Path, key: str, value: object, line: str) -> None:
    text = changed_file(scene, {key: value}).decode()
    assert line in text
    assert f"from scene.toml by seatfem live: {key} = " in text.splitlines()[0]
    *tables, name = key.split(".")
    wanted = place = tomllib.loads(SCENE)
    for table in tables:
        place = place.setdefault(table, {})
    place[name] = value
    assert tomllib.loads(text) == wanted
    rest = [each for each in text.splitlines()[1:] if each not in SCENE.splitlines()]
    assert len(rest) <= 3  # of a new table: a blank line, its head, the key


def test_a_value_that_cannot_be_replaced_alone(tmp_path: Path) -> None:
    path = write_scene(tmp_path, 'reed.mass = """\n1 g"""\n')
    with pytest.raises(LiveError, match=r"reed.mass cannot be replaced alone .*; write reed.mass = \"2 g\" by hand"):
        changed_file(path, {"reed.mass": "2 g"})


def test_only_the_newest_request_counts(scene: Path, tmp_path: Path) -> None:
    """A report of progress ends what is computed once a newer request waits, but for the first full run."""
    with (tmp_path / "answers").open("w", encoding="utf-8") as answers:
        session = Session(scene, {}, answers)
        session.waiting.put({"values": {}})
        session.progress("mesh", 0.5)
        session.known = object()  # type: ignore[assignment]
        with pytest.raises(Superseded):
            session.progress("mesh", 0.6)


def test_wrong_scenes_end_before_a_page_opens(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_scene(tmp_path, SCENE.replace("velocity", "velocty"))
    assert run_command(["live", str(path), "--no-browser"]) == BAD_INPUT
    assert "reed.velocty: unknown key; did you mean 'velocity'?" in capsys.readouterr().err
    write_scene(tmp_path, SCENE)
    assert run_command(["live", str(path), "--no-browser", "--set", "reed.mass=0 g"]) == BAD_INPUT
    assert "reed.mass" in capsys.readouterr().err
    assert threading.active_count() == 1
