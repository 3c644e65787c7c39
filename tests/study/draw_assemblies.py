"""Draws the parts of meshes/valve_plate_assembly.py moved, tilted and scaled: python draw_assemblies.py FOLDER."""

import math
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2] / "meshes"))

import valve_plate_assembly as parts
from valve_plate_assembly import Bodies, flapper, plate, write


def turned(occ: Any, bodies: Bodies) -> None:
    """Turn bodies by 30 degrees in the plane, and shift them."""
    occ.rotate(bodies, 0, 0, 0, 0, 0, 1, math.radians(30))
    occ.translate(bodies, 17.0, -9.0, 4.0)


def tumbled(occ: Any, bodies: Bodies) -> None:
    """Turn bodies so that they are square to no axis of the file."""
    occ.rotate(bodies, 3, -2, 1, 1, 2, 3, math.radians(50))
    occ.translate(bodies, -5.0, 8.0, 21.0)


def tilted(occ: Any, bodies: Bodies) -> None:
    """Tilt bodies by 0.4 degrees about 35 degrees from the reed's axis, through a point under its paddle."""
    occ.rotate(bodies, 0, 0, 6.52, math.cos(math.radians(35)), math.sin(math.radians(35)), 0, math.radians(0.4))
    occ.translate(bodies, 0, 0, 0.03)


def tilted_and_turned(occ: Any, bodies: Bodies) -> None:
    tilted(occ, bodies)
    turned(occ, bodies)


def shifted(x: float, y: float, z: float) -> Any:
    return lambda occ, bodies: occ.translate(bodies, x, y, z)


def in_lengths(part: Any, factor: float) -> Any:
    """Scale all lengths of the part by a factor, as of a file in another unit."""

    def drawn(occ: Any) -> Bodies:
        kept = {name: value for name, value in vars(parts).items() if name.isupper()}
        vars(parts).update({name: times(value, factor) for name, value in kept.items()})
        try:
            return part(occ)
        finally:
            vars(parts).update(kept)

    return drawn


def times(value: Any, factor: float) -> Any:
    return tuple(times(each, factor) for each in value) if isinstance(value, tuple) else factor * value


def plate_with_pin(occ: Any) -> Bodies:
    """Return the plate with a pin of 2 mm that rises through the neck of the flapper."""
    return list(occ.fuse(plate(occ), [(3, occ.addCylinder(-15, 0, 5, 0, 0, 3, 1))])[0])


LOW = 0.001 - (0.05 - 4.6 * math.tan(math.radians(0.4)))
"""To a gap of 1 um over the middle of the lip."""


def main(folder: Path) -> None:
    write(folder / "plate.step", plate)
    write(folder / "pin.step", plate_with_pin)
    write(folder / "flapper.step", flapper)
    for move in (turned, tumbled):
        write(folder / f"{move.__name__}_plate.step", plate, move)
        write(folder / f"{move.__name__}_flapper.step", flapper, move)
    write(folder / "tilted_flapper.step", flapper, tilted)
    write(folder / "turned_tilted_flapper.step", flapper, tilted_and_turned)
    write(
        folder / "low_flapper.step",
        flapper,
        lambda occ, bodies: (tilted(occ, bodies), occ.translate(bodies, 0, 0, LOW)),
    )
    write(folder / "off_flapper.step", flapper, shifted(0.4, -0.3, 0.01))
    write(folder / "half_off_flapper.step", flapper, shifted(0, 4, 0))
    write(folder / "far_flapper.step", flapper, shifted(0, 20, 0))
    write(folder / "sunk_flapper.step", flapper, shifted(0, 0, -0.1))
    write(folder / "small_flapper.step", in_lengths(flapper, 1e-3))
    write(folder / "inch_flapper.step", in_lengths(flapper, 1 / 25.4))
    write(folder / "large_flapper.step", in_lengths(flapper, 1e3))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
