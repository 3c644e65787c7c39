"""Datasets of universal files by the rules of their columns: meshes, responses, modes."""

from collections.abc import Sequence

import numpy as np


def dataset(number: int | str, *lines: str) -> str:
    return "\n".join(["    -1", f"{number:>6}", *lines, "    -1"]) + "\n"


def in_columns(numbers: Sequence[float], width: int, each: int = 8, digits: int = 0) -> list[str]:
    """Lines of so many numbers in columns, with an exponent D where digits are given."""
    words = [f"{x:{width}.{digits}E}".replace("E", "D") if digits else f"{x:{width}}" for x in numbers]
    return ["".join(words[k : k + each]) for k in range(0, len(words), each)]


def columns(*numbers: int) -> str:
    return "".join(f"{number:10}" for number in numbers)


def units(code: int, length: float, force: float = 1.0, offset: bool = True) -> str:
    factors = in_columns((length, force, 1.0), 25, digits=17)
    return dataset(
        164, f"{code:10}{'units of our own':<20}{2:10}", *factors, *in_columns([273.15] * offset, 25, digits=17)
    )


TET = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
HEX = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CONTOUR = (0, 4, 1, 5, 2, 6, 7, 8, 9, 3)
"""A tetrahedron of ten nodes: a face with its middles, the edges upwards, the top."""


def nodes(number: int, places: Sequence[Sequence[float]], system: int = 1) -> str:
    lines = []
    for k, place in enumerate(places, start=1):
        head = f"{k:10}{system:10}{1:10}{11:10}"
        row = in_columns(place, 13 if number == 15 else 25, digits=5 if number == 15 else 16)
        lines += [head + row[0]] if number == 15 else [head, *row]
    return dataset(number, *lines)


def elements(number: int, *rows: tuple[int, Sequence[int]]) -> str:
    lines = []
    for k, (kind, corners) in enumerate(rows, start=1):
        middle = (1, 1, 7) if number == 2412 else (1, 1, 1, 1, 7)
        lines += in_columns((k, kind, *middle, len(corners)), 10)
        lines += [f"{0:10}{1:10}{1:10}"] if kind == 21 else []
        lines += in_columns(corners, 10)
    return dataset(number, *lines)


def groups(number: int, **members: Sequence[tuple[int, int]]) -> str:
    lines = []
    for k, (name, each) in enumerate(members.items(), start=1):
        pair = number in (2417, 2429, 2430, 2432)
        lines += [*in_columns((k, 0, 0, 0, 0, 0, 0, len(each)), 10), name]
        lines += in_columns([x for code, of in each for x in ((code, of) if pair else (code, of, 0, 0))], 10)
    return dataset(number, *lines)


def system(label: int, *rows: Sequence[float], kind: int = 0) -> str:
    return dataset(
        2420, f"{1:10}", "part", f"{label:10}{kind:10}{8:10}", "CS", *(in_columns(r, 25, digits=16)[0] for r in rows)
    )


F = np.linspace(20.0, 200.0, 10)
H = (1.5 - 0.5j) * np.exp(1j * F / 70) * (1 + F / 100)


def axis(kind: int, unit: str, label: str = "NONE") -> str:
    return f"{kind:10}{0:5}{0:5}{0:5} {label:<20} {unit:<20}"


def function(
    form: int = 6,
    even: int = 1,
    kind: int = 12,
    unit: str = "m/s^2",
    force: str = "N",
    ends: str = "1   3",
    of: tuple[np.ndarray, np.ndarray] = (F, H),
) -> str:
    """Dataset 58 of values over frequencies, in the columns of its form, a number in single or double precision."""
    f, h = of
    double = form in (4, 6)
    fields = ([] if even else [(f, 13, 5)]) + [(x, 20 if double else 13, 11 if double else 5) for x in (h.real, h.imag)]
    per_row = {(6, 1): 2, (5, 1): 3, (6, 0): 1, (5, 0): 2}[form, even]
    words = ["".join(f"{x[k]:{width}.{digits}E}" for x, width, digits in fields) for k in range(len(f))]
    rows = ["".join(words[k : k + per_row]) for k in range(0, len(words), per_row)]
    node, direction = ends.split()
    end = f" {'NONE':<10}{node:>10}{direction:>4}"
    start, step = (f[0], f[1] - f[0]) if even else (0.0, 0.0)
    return dataset(
        58, "response of the plate", "second name", "12-Mar-24 10:00:00", "NONE", "NONE",
        f"{4:5}{0:10}{1:5}{0:10}{end} {'NONE':<10}{1:10}{3:4}",
        f"{form:10}{len(f):10}{even:10}{start:13.5E}{step:13.5E}{0.0:13.5E}",
        axis(18, "Hz"), axis(kind, unit), axis(13, force), axis(0, "NONE"), *rows,
    )  # fmt: skip


def mode(
    number: int,
    frequency: float,
    mass: float = 1.0,
    width: int = 3,
    form: int = 2,
    ratios: tuple[float, float] = (0.02, 0.0),
) -> str:
    shapes = {5: (0.1, 0.2, 0.3 * number), 9: (0.0, -1.0, 0.5)}
    lines = []
    for node, shape in shapes.items():
        values = [*shape, *[0.0] * (width - 3)]
        lines += [f"{node:10}", *in_columns([x for v in values for x in ((v, 0.0) if form == 5 else (v,))], 13, 6, 5)]
    return dataset(
        55, "shape of a plate", "NONE", "NONE", "NONE", "NONE", columns(1, 2, 3 if width == 6 else 2, 8, form, width),
        *in_columns((2, 4, 0, number), 10), *in_columns((frequency, mass, *ratios), 13, 6, 5), *lines,
    )  # fmt: skip
