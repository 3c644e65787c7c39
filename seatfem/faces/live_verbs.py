"""The verb live: a page in the browser of this machine, with sliders of a scene."""

from __future__ import annotations

from typing import Annotated, Final

from cyclopts import Parameter

from seatfem.faces.live import server as live_server
from seatfem.faces.report import page
from seatfem.faces.scene_verbs import SceneFile
from seatfem.faces.terminal import COMMON, DONE, FAILED, Changes, Common, changed, lines, load
from seatfem.jobs import folders

OPENING: Final = '<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="0; url={address}">'


def live(
    scene: SceneFile,
    /,
    *,
    no_browser: Annotated[bool, Parameter(negative="", help="Print the address of the page only.")] = False,
    changes: Changes = (),
    common: Common = COMMON,
) -> int:
    """Open a page in the browser of this machine: sliders of the scene, and force, lift and measures as they move. The
    scene is computed in full first; a slider that leaves seat and reed as they are then answers at once, by the method
    and with the relative error bars of that run. Closing the page, or Ctrl-C, ends it.
    """
    load(scene, changes)
    terminal = lines(quiet=common.quiet)
    with folders.private_folder("live") as folder:
        server = live_server.LiveServer(scene, dict(map(changed, changes)), folder / "log.txt")
        try:
            terminal.print(f"{server.address}\nfor this machine and one browser; close the page or press Ctrl-C to end")
            opening = folder / "open.html"  # else every user of this machine reads the token in the list of processes
            opening.write_text(OPENING.format(address=server.address), encoding="utf-8")
            if not no_browser and not page.open_in_browser(opening):
                terminal.print("no browser opens here; open this address in one")
            code = server.run()
        finally:
            server.server_close()
    terminal.print("the page was closed" if code == 0 else "the process that computes has ended")
    return DONE if code == 0 else FAILED


VERBS: Final = (live,)
