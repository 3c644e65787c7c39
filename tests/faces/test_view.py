"""The viewer: who is let in, what a browser shows, how it ends."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.pictures.moving import save_moving
from seatfem.pictures.rendering import can_draw
from tests.browsing import PATIENCE, changed, put, shot, until
from tests.moving_block import block_modes, block_wave

ADDRESS = re.compile(r"http://127\.0\.0\.1:(\d+)/index\.html\?secret=([\w-]{43})$")
needs_trame = pytest.mark.skipif(
    any(find_spec(name) is None for name in ("trame", "trame_vtk", "aiohttp")),
    reason="seatfem[web] is not installed",
)


def _folder(where: Path, *, waves: bool = True) -> Path:
    where.mkdir(exist_ok=True)
    save_moving(block_modes(), where / "modes.h5")
    if waves:
        save_moving(block_wave(), where / "stress_wave.h5")
    return where


def test_a_folder_without_bodies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["view", str(tmp_path)]) == BAD_INPUT
    told = capsys.readouterr().err
    assert f"{tmp_path}: holds nothing to view" in told
    assert "modes.h5: seatfem modes" in told
    assert run_command(["view", str(tmp_path / "valve")]) == BAD_INPUT
    assert "no such folder; give that of a run (seatfem run -o), as valve-result" in capsys.readouterr().err


def test_a_scene_is_no_folder_of_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "valve.toml").touch()
    assert run_command(["report", str(tmp_path / "valve.toml")]) == BAD_INPUT
    assert "is a file; give the folder of a run (seatfem run -o), as valve-result" in capsys.readouterr().err


def test_without_trame(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "trame.app", None)
    assert run_command(["view", str(_folder(tmp_path / "run"))]) == BAD_INPUT
    assert "pip install 'seatfem[web]'" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [["--port", "70000"], ["--timeout", "-1"], ["--port", "seven"]])
def test_bad_options(tmp_path: Path, arguments: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command(["view", str(tmp_path), *arguments]) == BAD_INPUT
    assert arguments[0] in "".join(capfd.readouterr())


@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
def test_what_is_drawn_and_told() -> None:
    """The top moves by 1 µm in the last frame, under 50 MPa; a section takes the upper half away."""
    from seatfem.faces.viewer.stage import Look, Stage

    stage = Stage(block_wave())
    assert stage.factor(0.0) == 1.0
    assert stage.factor(0.5) == pytest.approx(0.1 * 10e-3 / 1e-6, rel=1e-6)
    stage.show(Look(frame=4))
    plotter = stage.plotter
    plotter.suppress_rendering = False
    plotter.render()
    whole = np.array(plotter.image[..., :3], dtype=float)
    assert (whole.min(axis=2) < 240).mean() > 0.05
    top = int(stage.body.points[:, 2].argmax())
    assert "displacement (0, 0, 1) µm; von Mises stress 50 MPa or more" in stage.told(top, 4)
    assert "no von Mises stress is told" in stage.told(int(stage.body.points[:, 2].argmin()), 4)
    assert stage.probe(0.5, 0.5).startswith("at (")
    assert stage.probe(0.01, 0.01) == ""
    stage.show(Look(frame=4, plane="z", cut=0.5))
    plotter.render()
    half = np.array(plotter.image[..., :3], dtype=float)
    assert (half.min(axis=2) < 240).mean() < 0.8 * (whole.min(axis=2) < 240).mean()
    plotter.close()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, str]]:
    """The verb in a process of its own, and the address that it printed."""
    if not can_draw():
        pytest.skip("VTK cannot draw here")
    folder = _folder(tmp_path_factory.mktemp("view") / "run")
    words = [sys.executable, "-m", "seatfem", "view", str(folder), "--timeout", "300"]
    running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert running.stdout is not None
    try:
        yield running, running.stdout.readline().strip()
    finally:
        running.kill()
        running.wait()


@needs_trame
def test_only_who_knows_the_token_is_answered(served: tuple[Any, str]) -> None:
    """Pages, files and the websocket, without and with a wrong one; the websocket asks for it once more."""
    import aiohttp
    import msgpack

    found = ADDRESS.match(served[1])
    assert found, served[1]
    root, token = f"http://127.0.0.1:{found[1]}", found[2]
    wrong = token[:-1] + ("A" if token[-1] != "A" else "B")

    async def ask() -> None:
        async with aiohttp.ClientSession(cookie_jar=aiohttp.DummyCookieJar()) as stranger:
            for path in ("/", "/index.html", f"/index.html?secret={wrong}", "/index.html?secret=", "/logo.png"):
                async with stranger.get(root + path) as answer:
                    assert answer.status == 403, path
                    assert "set-cookie" not in answer.headers
            async with stranger.post(f"{root}/paraview/") as answer:
                assert answer.status == 403
            for query in ("", f"?secret={wrong}"):
                with pytest.raises(aiohttp.WSServerHandshakeError, match="403"):
                    await stranger.ws_connect(f"{root}/ws{query}")
        async with aiohttp.ClientSession(cookie_jar=aiohttp.CookieJar(unsafe=True)) as friend:
            async with friend.get(f"{root}/index.html?secret={token}") as answer:
                assert answer.status == 200
                assert "HttpOnly" in answer.headers["set-cookie"]
                assert "SameSite=Strict" in answer.headers["set-cookie"]
            for secret, word in ((wrong, b"Authentication failed"), ("wslink-secret", b"Authentication failed")):
                async with friend.ws_connect(f"{root}/ws") as socket:
                    await socket.send_bytes(_chunk(msgpack.packb(_hello(secret))))
                    assert word in (await socket.receive()).data
            async with friend.ws_connect(f"{root}/ws") as socket:
                await socket.send_bytes(_chunk(msgpack.packb(_hello(token))))
                assert b"clientID" in (await socket.receive()).data

    asyncio.run(asyncio.wait_for(ask(), PATIENCE))


def _hello(secret: str) -> dict[str, Any]:
    return {"wslink": "1.0", "id": "system:c0:0", "method": "wslink.hello", "args": [{"secret": secret}], "kwargs": {}}


def _chunk(message: bytes) -> bytes:
    """As wslink cuts messages: number, offset, length."""
    return b"\1\2\3\4" + (0).to_bytes(4, "little") + len(message).to_bytes(4, "little") + message


@needs_trame
def test_it_listens_to_this_machine_alone(served: tuple[Any, str]) -> None:
    import psutil

    listening = [each for each in psutil.Process(served[0].pid).net_connections() if each.status == "LISTEN"]
    assert {each.laddr.ip for each in listening} == {"127.0.0.1"}


@needs_trame
@pytest.mark.slow
def test_its_controls_change_the_picture(served: tuple[Any, str], chromium: Any) -> None:
    running, address = served
    chromium.get_log("browser")
    chromium.get(address)
    stage = until(lambda: next(iter(chromium.find_elements("id", "stage")), None), "the page")
    picture = until(lambda: (now := shot(stage)).std() > 8 and [now], "a picture")[0]

    def set_to(name: str, value: str, what: str) -> None:
        nonlocal picture
        put(chromium, until(lambda: next(iter(chromium.find_elements("id", name)), None), name), value)
        picture = changed(stage, picture, what)

    set_to("mode", "1", "another mode")
    set_to("scale", "95", "more exaggeration")
    set_to("plane", "z", "a section")
    set_to("cut", "80", "a section elsewhere")
    set_to("plane", "", "no section")
    stage.click()
    told = until(lambda: (text := chromium.find_element("id", "probe").text).startswith("at") and text, "told")
    assert re.search(r"at \(.*\) mm: displacement \(.*\) of the largest", told)
    set_to("body", "stress_wave.h5", "another body")
    set_to("time", "3", "another time")
    set_to("colour", "displacement", "other colours")
    from selenium.webdriver import ActionChains

    ActionChains(chromium).click_and_hold(stage).move_by_offset(120, 40).release().perform()
    turned = changed(stage, picture, "turned")
    chromium.find_element("id", "reset").click()
    first = changed(stage, turned, "the first view")
    chromium.find_element("id", "turn").click()
    changed(stage, first, "turned by a button")
    chromium.find_element("id", "play").click()
    until(lambda: "3 µs" not in chromium.find_element("css selector", ".controls").text, "in motion")
    assert "landing" in chromium.find_element("id", "absent").text
    assert [each for each in chromium.get_log("browser") if each["level"] != "INFO"] == []
    chromium.get("about:blank")
    running.send_signal(signal.SIGINT)
    said = running.communicate(timeout=PATIENCE)[0]
    assert running.returncode == 0, said
    assert "Traceback" not in said
    assert said.rstrip().endswith("ended")


@needs_trame
@pytest.mark.skipif(not can_draw(), reason="VTK cannot draw here")
def test_it_ends_when_nobody_looks(tmp_path: Path) -> None:
    from seatfem.faces.viewer.serve import view

    told: list[str] = []
    start = time.monotonic()
    view(_folder(tmp_path / "run", waves=False), told.append, timeout=1)
    assert time.monotonic() - start >= 1.0
    assert len(told) == 1
    assert ADDRESS.match(told[0])
