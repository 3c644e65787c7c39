"""The server of the viewer: trame's page of controls beside pictures that VTK draws here; on this machine alone."""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib import resources
from pathlib import Path
from secrets import token_hex
from typing import Any, Final

from impact.extras import how_to_mend
from seatfem.faces.viewer.guard import NAME, admit, new_token
from seatfem.faces.viewer.stage import PLANES, Look, Stage
from seatfem.pictures.moving import KEPT, SOURCES, Moving, absent, moving_bodies

HOST: Final = "127.0.0.1"
PERIOD: Final = 1.5  # s, that a mode is drawn in
PAUSE: Final = 0.15  # s between frames
_CLICKS: Final = (  # that are no drags: where in the picture, from 0 to 1
    '@pointerdown.capture="down = [$event.clientX, $event.clientY]"',
    '@click="Math.hypot($event.clientX - down[0], $event.clientY - down[1]) < 4'
    " && trigger('probe', [($event.clientX - $event.currentTarget.getBoundingClientRect().left)"
    " / $event.currentTarget.clientWidth, ($event.clientY - $event.currentTarget.getBoundingClientRect().top)"
    ' / $event.currentTarget.clientHeight])"',
)


class ViewError(ValueError):
    """A folder without anything to view, or a package that is missing; the message names the remedy."""


def bodies_to_view(folder: Path) -> dict[str, Moving]:
    """What a folder has to show, by file name.

    Raises:
        ViewError: nothing.
        StorageError: a damaged file.
    """
    if not folder.is_dir():
        raise ViewError(f"{folder}: no such folder; give that of a run (seatfem run -o), as {folder.stem}-result")
    if found := moving_bodies(folder):
        return found
    wanted = "; ".join(f"{name}: {source}" for name, source in SOURCES.items())
    raise ViewError(f"{folder}: holds nothing to view; run the scene without --no-pictures ({wanted})")


def view(folder: Path, tell: Callable[[str], None], *, port: int = 0, timeout: int = 0) -> None:
    """Serve what a folder holds until the process is asked to end, or nobody has looked for ``timeout`` seconds.

    Only this machine is listened to, and only those are answered who know the token in the address that ``tell`` is
    handed once the server listens.

    Args:
        folder: of a run, or of modes.
        tell: receives the address.
        port: to listen at; 0: any that is free.
        timeout: [s] without anybody looking; 0: for ever.

    Raises:
        ViewError: nothing to view; trame is missing.
        PictureError: VTK cannot draw here.
        StorageError: a damaged file.
        OSError: the port is taken.
    """
    bodies = bodies_to_view(folder)
    try:
        with suppress(DeprecationWarning):
            from trame.app import get_server
            from trame.widgets import vtk  # noqa: F401
    except ImportError as missing:
        raise ViewError(f"the page is served by trame: {how_to_mend('trame', 'web', missing)}") from None
    token = new_token()
    server: Any = get_server(token_hex(8), client_type="vue3")  # one of its own
    os.environ["TRAME_ARGS"] = ""  # else it would read the options of this program as its own
    server.cli.set_defaults(authKey=token)
    server.controller.on_server_bind.add(lambda bound: admit(bound.app, token))
    server.controller.on_server_ready.add(lambda **_: tell(f"http://{HOST}:{server.port}/index.html?{NAME}={token}"))
    page = _Page(server, bodies)

    async def serve() -> None:
        how = {"open_browser": False, "show_connection_info": False, "disable_logging": True, "thread": True}
        await server.start(exec_mode="coroutine", host=HOST, port=port, timeout=timeout, **how)

    try:
        asyncio.run(serve())
    finally:
        page.close()


class _Page:
    """Controls, and what follows from each."""

    def __init__(self, server: Any, bodies: Mapping[str, Moving]) -> None:
        self._bodies, self._state = bodies, server.state
        first = next(iter(bodies))
        self._stage, self._moving = Stage(bodies[first]), False
        self._state.update({"body": first, "playing": False, "probe": "", "trame__title": "seatfem view"})
        self._state.update({"bodies": [{"name": name, "title": KEPT[name]} for name in bodies]})
        self._state.absent = absent(bodies)
        self._state.update({"down": [0, 0]})
        server.trigger("probe")(self._probe)
        self._view = self._laid_out(server)
        self._state.change("body")(self._other_body)
        self._state.change("frame", "colour", "scale", "plane", "cut")(self._draw)
        self._state.change("playing")(self._play)
        server.controller.on_client_exited.add(self._stop)
        self._other_body(body=first)

    def _other_body(self, body: str, **_: object) -> None:
        if body not in self._bodies:
            return
        shown = self._bodies[body]
        self._stage.put(shown)
        labels, modes = list(shown.labels), shown.time is None
        self._state.update({"labels": labels, "last": len(labels) - 1, "modes": modes})
        self._state.update({"frame": 0, "scale": 50, "plane": "", "cut": 50, "playing": False, "probe": ""})
        self._state.update({"colour": "values", "quantity": shown.quantity, "said": _said(shown)})
        self._draw()

    def _draw(self, phase: float = 1.0, **_: object) -> None:
        look = _look(self._state, len(self._stage.body.labels), phase)
        self._state.label = self._stage.body.labels[look.frame]
        factor, body = self._stage.factor(look.scale), self._stage.body
        share, times = 100 * factor * body.largest / body.size, float(f"{factor:.3g}")
        self._state.factor = f"{share:.3g} % of the size" if self._state.modes else f"{times:,g} times"
        self._stage.show(look)
        self._view.update()

    def _play(self, playing: bool, **_: object) -> None:
        if playing and not self._moving:
            self._moving = True
            asyncio.get_event_loop().create_task(self._move())

    def _stop(self, **_: object) -> None:
        """Nobody looks."""
        self._state.playing = False

    def close(self) -> None:
        """Let go of what VTK holds."""
        self._stage.plotter.close()

    async def _move(self) -> None:
        try:
            turn = 0.0
            while self._state.playing:
                await asyncio.sleep(PAUSE)
                with self._state:
                    if self._state.modes:
                        turn += PAUSE / PERIOD
                        self._draw(phase=math.cos(2 * math.pi * turn))
                    else:
                        self._state.frame = (int(self._state.frame) + 1) % (int(self._state.last) + 1)
        finally:
            self._moving = False
            with self._state:
                self._draw()

    def _probe(self, across: float, down: float) -> None:
        with suppress(TypeError, ValueError):
            self._state.probe = self._stage.probe(float(across), 1.0 - float(down)) or "nothing there"

    def _turn(self, around: float, up: float) -> None:
        self._stage.turn(around, up)
        self._view.update()

    def _reset(self) -> None:
        self._stage.reset()
        self._view.update()

    def _laid_out(self, server: Any) -> Any:
        from trame.ui.html import DivLayout
        from trame.widgets import client, html
        from trame.widgets import vtk as views

        with DivLayout(server, classes="page"):
            client.Style(resources.files(__package__).joinpath("view.css").read_text(encoding="utf-8"))
            with html.Div(classes="controls", raw_attrs=['role="group"', 'aria-label="what is shown"']):
                with html.Label("body "), html.Select(v_model=("body",), id="body"):
                    html.Option("{{ each.title }}", v_for="each in bodies", key="each.name", value=("each.name",))
                html.Button("{{ playing ? 'pause' : 'play' }}", click="playing = !playing", id="play")
                with html.Label("mode ", v_if=("modes",)), html.Select(v_model=("frame",), id="mode"):
                    html.Option("{{ each }}", v_for="(each, k) in labels", key="k", value=("k",))
                with html.Label("time ", v_if=("!modes",)):
                    html.Input(type="range", min=0, max=("last",), v_model=("frame",), id="time")
                html.Output("{{ label }}", v_if=("!modes",))
                with html.Label("colour ", v_if=("quantity",)), html.Select(v_model=("colour",), id="colour"):
                    html.Option("{{ quantity }}", value="values")
                    html.Option("displacement", value="displacement")
                with html.Label("exaggeration "):
                    html.Input(type="range", min=0, max=100, v_model=("scale",), id="scale")
                html.Output("{{ factor }}")
                with html.Label("section across "), html.Select(v_model=("plane",), id="plane"):
                    html.Option("none", value="")
                    for name in PLANES:
                        html.Option(name, value=name)
                with html.Label("at ", v_if=("plane",)):
                    html.Input(type="range", min=0, max=100, v_model=("cut",), id="cut")
                html.Button("turn", click=(self._turn, "[20, 0]"), id="turn")
                html.Button("tilt", click=(self._turn, "[0, 20]"))
                html.Button("reset camera", click=self._reset, id="reset")
            with html.Div(classes="stage", id="stage", raw_attrs=[*_CLICKS, 'role="img"', 'aria-label="the body"']):
                shown = views.VtkRemoteView(self._stage.plotter.render_window, interactive_ratio=1, still_quality=95)
            html.P(
                "{{ probe || 'Click on the body for the values there.' }}",
                id="probe",
                raw_attrs=['aria-live="polite"'],
            )
            html.P("{{ said }} Drag to turn, Shift and drag to move, the wheel zooms.", classes="soft")
            html.P("Not in this folder: {{ absent }}.", v_if=("absent",), classes="soft", id="absent")
        return shown


def _look(state: Any, frames: int, phase: float) -> Look:
    """What the controls say; a page may send anything."""

    def number(name: str, most: float) -> float:
        try:
            found = float(state[name])
        except (TypeError, ValueError):
            return 0.0
        return min(max(found, 0.0), most) if math.isfinite(found) else 0.0

    plane = str(state.plane) if str(state.plane) in PLANES else ""
    frame, values = int(number("frame", frames - 1)), state.colour == "values"
    return Look(frame, values, number("scale", 100) / 100, phase, plane, number("cut", 100) / 100)


def _said(shown: Moving) -> str:
    count = len(shown.triangles)
    fewer = f" {count:,} of {shown.before:,} triangles are kept." if shown.before > count else ""
    return f"{shown.title}. {shown.note}{fewer} The surface alone is kept: a section looks into it."
