"""Write the drawings that the documents show.

    .venv/bin/python docs/drawings.py

Draws the examples of `DRAWN` into docs/images/; `docs/refresh.py` calls it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from seatfem.study.impacts.layout import draw_scene
from seatfem.study.scene import load_scene

ROOT = Path(__file__).resolve().parent.parent
DRAWN: Final = ("suction_valve", "tilted_landing", "cad_assembly")


def main() -> None:
    """Draw them."""
    for name in DRAWN:
        scene = load_scene(ROOT / "examples" / f"{name}.toml")
        draw_scene(scene, ROOT / "docs" / "images" / f"drawing_{name}.png")


if __name__ == "__main__":
    main()
