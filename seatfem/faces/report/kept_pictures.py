"""The pictures of a run in its page."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from impact.files.input_files import MB, read_bytes
from seatfem.faces.report.folder import ReportError

MOST_OF_A_PICTURE: Final = 3 * MB
MOST_OF_PICTURES: Final = 7 * MB // 2  # with plotly's 5 MB, bodies and curves the page stays below 15 MB
DRAWING: Final = "drawing.png"
"""The picture that a page begins with."""
CAPTIONS: Final[Mapping[str, str]] = {
    DRAWING: "The scene as it was computed: section along the reed through the contact, and plan, with sizes.",
    "force.png": "Contact force, seat and spring baseline.",
    "lip.png": "Force per length along the lip over angle and time, impulse, gaps and tilt.",
    "landing.gif": "The plate as it lands, its deflection exaggerated.",
    "mesh.png": "The seat's mesh; the contact face and the clamped faces are coloured.",
    "modes.png": "Modes of the seat.",
    "mode_1.gif": "The first mode of the seat.",
    "greens.png": "The driving-point Green's function: impulse response, step response, receptance.",
    "seat_stress.png": "Largest stress on the seat, and its histories.",
    "stress_histories.png": "Stress over time at the hot spots of reed and seat.",
    "margin.png": "Margin against speed.",
    "gas.png": "Pressures, lift and flow over the cycle.",
    "fit.png": "The measured response and what was fitted to it.",
    "stabilisation.png": "The poles of each number of modes that was tried, and which of them stay.",
}
INTERACTIVE: Final = ("motion.png", "energy.png")
"""Pictures whose curves are all in the page as figures."""
INSTEAD: Final[Mapping[str, str]] = {
    "mode_1.gif": "modes.h5",
    "stress_wave.gif": "stress_wave.h5",
    "reed_stress_wave.gif": "reed_stress_wave.h5",
    "landing.gif": "landing.h5",
}
"""Pictures in whose place bodies are in the page, where there are any."""
STILLS: Final = ("landing.gif",)
"""Those of them that are in the page all the same, for browsers that draw no bodies, and for what they print."""


def kept_pictures(folder: Path) -> str:
    """Return the pictures that the page does not hold otherwise, each with its caption; what is too large is named."""
    shown, room = [], MOST_OF_PICTURES
    files = sorted(file for pattern in ("*.png", "*.gif") for file in folder.glob(pattern) if not file.is_symlink())
    for file in sorted(files, key=lambda file: file.name in STILLS):
        if file.name == DRAWING:
            continue
        size = file.stat().st_size
        drawn = (folder / INSTEAD.get(file.name, file.name + "?")).is_file()
        if file.name in INTERACTIVE or (drawn and (file.name not in STILLS or size > min(room, MOST_OF_A_PICTURE))):
            continue
        caption = CAPTIONS.get(file.name, file.stem.replace("_", " "))
        if size > MOST_OF_A_PICTURE or size > room:
            shown.append(f"<p>{html.escape(file.name)} is too large for this page; it lies beside the results.</p>")
            continue
        room -= size
        shown.append(_figure(file, caption, ' class="still"' if drawn else ""))
    return "".join(shown)


def first_picture(folder: Path) -> str:
    """Return the drawing of the scene with its caption; "" of a run that has none."""
    file = folder / DRAWING
    if not file.is_file() or file.is_symlink() or file.stat().st_size > MOST_OF_A_PICTURE:
        return ""
    return _figure(file, CAPTIONS[DRAWING])


def _figure(file: Path, caption: str, style: str = "") -> str:
    data = base64.b64encode(read_bytes(file, MOST_OF_A_PICTURE, ReportError)).decode("ascii")
    kind = file.suffix.removeprefix(".").lower()
    image = f'<img src="data:image/{kind};base64,{data}" alt="{html.escape(caption)}" loading="lazy">'
    return f"<figure{style}>{image}<figcaption>{html.escape(caption)}</figcaption></figure>"
