"""Seats drawn at random, of every kind that a scene may have: text of [seat], and the files that it names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from scipy import sparse

import impact
from impact.storage.hdf5 import save_greens

MESHES: Final = Path(__file__).parents[1] / "meshes"
PARTS: Final = ("stopper", "conical_seat", "flat_seat", "bar")
SOLIDS: Final = ("plate", "bar", "block")
DEAR: Final = ("plate", "block")
"""Kinds that always state a mesh and a band: in space, wider ones take minutes."""
LIPPED: Final = "annular"
"""The kind of revolution whose struck face is a lip, at a cost that many scenes can bear."""
NODES: Final = 40  # of a seat given by matrices

Write = Callable[[Path], None]
"""It writes one file at a path."""


@dataclass(frozen=True)
class Seat:
    """A seat.

    Attributes:
        kind: of [seat].
        table: its lines, the head included.
        radius: mean radius of its lip [mm]; 0 without one. Of what is no ring about its middle that of one around it.
        width: of the lip [mm].
        is_ring: whether the lip is one ring, which a plate may meet with a ring of its own.
        stated: whether keys are stated that the loop would choose.
        files: by name, what writes them.
    """

    kind: str
    table: str
    radius: float = 0.0
    width: float = 0.0
    is_ring: bool = True
    stated: bool = False
    files: Mapping[str, Write] = field(default_factory=dict)


def annular(rng: np.random.Generator) -> tuple[str, float]:
    """Return the lines of an annular seat and a typical length [mm], as the other kinds below do."""
    bore, lip = rng.uniform(2, 5), rng.uniform(0.8, 2)
    edge = lip * rng.uniform(0.2, 0.35) if rng.random() < 0.5 else 0.0
    height = edge + rng.uniform(0.2, 0.6)
    outer, thickness = bore + lip + rng.uniform(2, 8), rng.uniform(3, 9)
    lines = _lines(
        bore_radius=bore, lip_width=lip, lip_height=height, lip_edge_radius=edge, outer_radius=outer,
        thickness=thickness,
    )  # fmt: skip
    return lines, np.sqrt((outer - bore) * thickness)


def conical(rng: np.random.Generator) -> tuple[str, float]:
    bore, face = rng.uniform(2, 5), rng.uniform(1, 2.5)
    outer, thickness = bore + face + rng.uniform(2, 8), face + rng.uniform(2, 6)
    angle = f'half_angle = "{rng.uniform(25, 65):.6f} deg"\n'
    lines = _lines(
        bore_radius=bore, face_width=face, contact_width=face * rng.uniform(0.3, 1), outer_radius=outer,
        thickness=thickness,
    )  # fmt: skip
    return angle + lines, np.sqrt((outer - bore) * thickness)


def stopper(rng: np.random.Generator) -> tuple[str, float]:
    radius, thickness = rng.uniform(3, 8), rng.uniform(3, 8)
    lines = _lines(radius=radius, thickness=thickness, contact_radius=radius * rng.uniform(0.2, 0.8))
    dome = _lines(dome_radius=radius * rng.uniform(4, 10)) if rng.random() < 0.5 else ""
    return lines + dome, np.sqrt(radius * thickness)


def bar(rng: np.random.Generator) -> tuple[str, float]:
    length, width, height = rng.uniform(8, 20), rng.uniform(3, 6), rng.uniform(3, 6)
    return _lines(length=length, width=width, height=height), np.cbrt(length * width * height / 4)


def block(rng: np.random.Generator) -> tuple[str, float]:
    width, depth, thickness = rng.uniform(6, 14), rng.uniform(6, 14), rng.uniform(4, 9)
    patch = {"patch_width": width * rng.uniform(0.2, 0.6), "patch_depth": depth * rng.uniform(0.2, 0.6)}
    lines = _lines(width=width, depth=depth, thickness=thickness, **patch)
    return lines, np.cbrt(width * depth * thickness / 4)


def plate(rng: np.random.Generator) -> tuple[str, float]:
    ports = int(rng.integers(3, 7))
    radius, land, thickness = rng.uniform(2, 3), rng.uniform(0.8, 1.2), rng.uniform(3, 5)
    pitch, margin = 2 * (radius + land) + rng.uniform(1.5, 3), radius + land + rng.uniform(3, 5)
    lines = _lines(
        port_radius=radius, pitch=pitch, margin=margin, thickness=thickness, land_width=land, clamp_width=1.5
    )
    return f"ports = {ports}\n" + lines, thickness


def _lines(**millimetres: float) -> str:
    return "".join(f'{key} = "{value:.6f} mm"\n' for key, value in millimetres.items())


GEOMETRY: Final = {
    "annular": annular, "conical": conical, "stopper": stopper, "plate": plate, "bar": bar, "block": block,
}  # fmt: skip
ELASTIC: Final = (*GEOMETRY, "cad", "mesh")
"""Kinds of finite elements, in which stress can be asked for."""


def draw_seat(kind: str, rng: np.random.Generator, *, stated: bool) -> Seat:
    """A seat of a kind; ``stated``: with its mesh and its band, where it has them."""
    if kind in GEOMETRY:
        return _of_geometry(kind, rng, stated)
    return OTHERS[kind](rng)


def _material(rng: np.random.Generator) -> str:
    named = ("steel", "grey cast iron", "aluminium", "PEEK")
    if rng.random() < 0.5:
        return f'material = "{rng.choice(named, p=[0.5, 0.2, 0.2, 0.1])}"\n'
    young, density = rng.uniform(70, 220), rng.uniform(2600, 8000)
    poisson = rng.uniform(0.2, 0.38)
    return f'material = {{ young = "{young:.4f} GPa", poisson = {poisson:.4f}, density = "{density:.2f} kg/m^3" }}\n'


def _damping(rng: np.random.Generator, least: float = 0.0) -> str:
    ratio = rng.uniform(0.005, 0.12) if rng.random() < 0.85 else least
    return f"damping_ratio = {ratio:.5f}\n"


def _of_geometry(kind: str, rng: np.random.Generator, stated: bool) -> Seat:
    lines, length = GEOMETRY[kind](rng)
    text, how = f'[seat]\nkind = "{kind}"\n{lines}{_material(rng)}{_damping(rng, 0.01 * (kind in SOLIDS))}', ""
    size = length / (rng.uniform(2, 3) if kind in SOLIDS else rng.uniform(6, 12))
    if stated or kind in DEAR:
        how = f'mesh = {{ size = "{size:.4f} mm", contact_size = "{size * rng.uniform(0.35, 0.7):.4f} mm" }}\n'
        band = rng.uniform(80, 200) if kind in SOLIDS else rng.uniform(150, 600)
        how += f'greens = {{ bandwidth = "{band:.3f} kHz", tolerance = {rng.uniform(0.005, 0.02):.5f} }}\n'
    values = dict(line.split(" = ") for line in lines.strip().splitlines())
    if kind != LIPPED:
        return Seat(kind, text + how, stated=bool(how))
    bore, width = (float(values[key].strip('" m')) for key in ("bore_radius", "lip_width"))
    edge = float(values.get("lip_edge_radius", '"0 mm"').strip('" m'))
    return Seat(kind, text + how, bore + width / 2, width - 2 * edge, stated=bool(how))


def _land(ports: int) -> Callable[[np.random.Generator], Seat]:
    """A plate with lands around one to three ports, all of which are struck."""

    def draw(rng: np.random.Generator) -> Seat:
        port, land = rng.uniform(2.0, 3.5) / np.sqrt(ports), rng.uniform(0.6, 1.2)
        pitch, layout = 2 * (port + land) + rng.uniform(0.5, 1.5), "row" if ports == 2 else "circle"
        lines = _lines(
            port_radius=port,
            pitch=pitch,
            margin=land + 3,
            thickness=rng.uniform(3, 6),
            land_width=land,
            clamp_width=1.5,
        )
        off = {1: 0.0, 2: pitch / 2, 3: pitch / np.sqrt(3)}[ports]
        text = f'[seat]\nkind = "plate"\nports = {ports}\nlayout = "{layout}"\n{lines}{_coarse(rng)}'
        width = land if ports == 1 else 0.5
        return Seat("plate", text, off + port + land - width / 2, width, ports == 1, stated=True)

    return draw


def _lip_of(
    file: str, radius: float, width: float, *, is_ring: bool = True, faces: str = ""
) -> Callable[[np.random.Generator], Seat]:
    """The lip of a part in meshes/."""
    kind = "mesh" if file.endswith(".msh") else "cad"

    def draw(rng: np.random.Generator) -> Seat:
        text = f'[seat]\nkind = "{kind}"\nfile = "{MESHES / file}"\n{faces}'
        how = _narrow(rng) if kind == "mesh" else _coarse(rng)
        return Seat(kind, text + how, radius, width, is_ring, stated=True)

    return draw


def _coarse(rng: np.random.Generator) -> str:
    size = f'mesh = {{ size = "{rng.uniform(3, 4):.3f} mm", contact_size = "{rng.uniform(0.7, 1):.3f} mm" }}\n'
    return size + _narrow(rng)


def _spring(rng: np.random.Generator) -> Seat:
    return Seat("spring", f'[seat]\nkind = "spring"\nstiffness = "{10 ** rng.uniform(6.5, 8.5):.5g} N/m"\n')


def _rod(rng: np.random.Generator) -> Seat:
    young, density = rng.uniform(70, 220), rng.uniform(2600, 8000)
    size = f'length = "{rng.uniform(5, 40):.5f} mm"\narea = "{10 ** rng.uniform(-0.3, 1.3):.5g} mm^2"\n'
    solid = f'young = "{young:.4f} GPa"\ndensity = "{density:.2f} kg/m^3"\n'
    return Seat("rod", f'[seat]\nkind = "rod"\n{solid}{size}{_damping(rng)}')


def _beam(rng: np.random.Generator) -> Seat:
    """A cantilever is struck near its tip: a seat that is known by modes."""
    text = f"""[seat]
kind = "cantilever"
length = "{rng.uniform(7, 12):.4f} mm"
width = "{rng.uniform(5, 10):.4f} mm"
thickness = "{rng.uniform(0.6, 1.2):.4f} mm"
damping_ratio = {rng.uniform(0.01, 0.05):.5f}
"""
    return Seat("cantilever", text)


def _modal(rng: np.random.Generator) -> impact.ModalGreens:
    """Modes from 8 to 150 kHz as of a seat of 10 to 300 N/um, with a passive rest."""
    count, compliance = int(rng.integers(3, 9)), 10 ** rng.uniform(-8.5, -7)
    omega = 2 * np.pi * np.sort(rng.uniform(8e3, 150e3, count))
    shares = rng.dirichlet(np.ones(count + 1))
    shapes = (omega * np.sqrt(compliance * shares[:-1]))[:, None]
    left = compliance * shares[-1]
    rest = impact.Residual.exponential(left, left / 3e-6)
    return impact.ModalGreens(omega, rng.uniform(0.005, 0.05, count), shapes, rest)


def _greens(rng: np.random.Generator) -> Seat:
    greens = _modal(rng)
    files = {"seat.h5": lambda path: save_greens(greens, path)}
    return Seat("greens", '[seat]\nkind = "greens"\nfile = "seat.h5"\n', files=files)


def _measured(rng: np.random.Generator) -> Seat:
    """A measured receptance up to 250 kHz; the poles that are fitted are the seat, of run and reference."""
    greens = _modal(rng)

    def write(path: Path) -> None:
        f = np.linspace(250.0, 250e3, 1000)
        h = greens.transfer(2j * np.pi * f)[:, 0, 0]
        rows = (f"{x:.9g},{value.real:.12g},{value.imag:.12g}" for x, value in zip(f, h, strict=True))
        head = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
        path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")

    text = '[seat]\nkind = "frf"\nfile = "seat.csv"\ntolerance = "2 %"\n'
    return Seat("frf", text, files={"seat.csv": write})


def _matrices(rng: np.random.Generator) -> Seat:
    """A rod in elements of first order, its last node struck."""
    young, density = 1e9 * rng.uniform(70, 220), rng.uniform(2600, 8000)
    length, area = 1e-3 * rng.uniform(5, 30), 1e-6 * 10 ** rng.uniform(0, 1.3)
    h = length / NODES
    ones, rest = np.ones(NODES - 1), np.append(np.full(NODES - 1, 2.0), 1.0)
    stiffness = sparse.diags_array([rest, -ones, -ones], offsets=[0, 1, -1]) * (young * area / h)
    mass = sparse.diags_array([2 * rest, ones, ones], offsets=[0, 1, -1]) * (density * area * h / 6)
    files: dict[str, Write] = {
        "K.npz": lambda path: sparse.save_npz(path, sparse.csr_array(stiffness)),
        "M.npz": lambda path: sparse.save_npz(path, sparse.csr_array(mass)),
        "port.csv": lambda path: _write(path, f"dof,weight\n{NODES},1\n"),
    }
    text = '[seat]\nkind = "matrices"\nmass = "M.npz"\nstiffness = "K.npz"\ncontact = "port.csv"\n'
    band = f'greens = {{ bandwidth = "{rng.uniform(150, 400):.3f} kHz" }}\n'
    return Seat("matrices", f"{text}{band}{_damping(rng, 0.005)}", stated=True, files=files)


def _cad(rng: np.random.Generator) -> Seat:
    """A CAD part whose mesh and band are stated as its size can afford."""
    part, size = MESHES / f"{PARTS[rng.integers(len(PARTS))]}.step", rng.uniform(3.0, 4.0)
    mesh = f'mesh = {{ size = "{size:.3f} mm", contact_size = "{size * rng.uniform(0.3, 0.4):.3f} mm" }}\n'
    return Seat("cad", f'[seat]\nkind = "cad"\nfile = "{part}"\n{mesh}{_narrow(rng)}', stated=True)


def _mesh(rng: np.random.Generator) -> Seat:
    text = f'[seat]\nkind = "mesh"\nfile = "{MESHES / "annular_seat.msh"}"\n{_narrow(rng)}'
    return Seat("mesh", text, stated=True)


def _narrow(rng: np.random.Generator) -> str:
    band = f'bandwidth = "{rng.uniform(60, 120):.3f} kHz", tolerance = {rng.uniform(0.01, 0.02):.4f}'
    return f"greens = {{ {band} }}\n{_material(rng)}{_damping(rng, 0.01)}"


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


OTHERS: Final[Mapping[str, Callable[[np.random.Generator], Seat]]] = {
    "spring": _spring, "rod": _rod, "cantilever": _beam, "greens": _greens, "frf": _measured, "matrices": _matrices,
    "cad": _cad, "mesh": _mesh,
}  # fmt: skip

LANDS: Final[tuple[Callable[[np.random.Generator], Seat], ...]] = (
    _land(1), _lip_of("kidney_seat.step", 6.3, 1.0, is_ring=False), _land(2), _lip_of("annular_seat.msh", 4.5, 0.8),
    _lip_of(
        "assembly_plate.step", 4.6, 1.2,
        faces='contact = { number = 13 }\nfixed = { radius = "2.25 mm", several = true }\n',
    ),
    _land(3), _lip_of("slot_seat.step", 5.5, 1.0, is_ring=False),
)  # fmt: skip
"""Seats with lands, lips and strips of plates, CAD parts and meshes, by turns."""
