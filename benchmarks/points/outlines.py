"""Reeds as blocks of mapped quadrilaterals: a sheet, a flapper and a ring, all symmetric about the x axis."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from points.gll import Array
from points.mesh import Block, equal_parts

INNER = 0.5  # half the diagonal of the square inside a paddle, over its radius


@dataclass(frozen=True)
class Sheet:
    """A rectangle [m], clamped at x = 0; its contact is centred at x = ``contact_at``."""

    length: float
    width: float
    contact_at: float

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of its contact [m]."""
        return self.contact_at, 0.0

    def blocks(self, size: float) -> list[Block]:
        """Return one block."""

        def place(s: Array, t: Array) -> Array:
            return np.stack([self.length * s, self.width * (t - 0.5)], axis=-1)

        return [Block(place, equal_parts(self.length, size), equal_parts(self.width, size))]


@dataclass(frozen=True)
class Flapper:
    """A clamped root that tapers to a neck, and a round paddle, about whose centre the contact is [m]."""

    root_width: float
    taper_length: float
    neck_width: float
    neck_length: float
    paddle_diameter: float

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of its contact [m]."""
        return self.neck_length + math.sqrt(self.paddle_diameter**2 - self.neck_width**2) / 2, 0.0

    def blocks(self, size: float) -> list[Block]:
        """Return taper, neck, four sectors of the paddle's rim and a square inside of them."""
        radius, (middle, _) = self.paddle_diameter / 2, self.centre
        half = math.asin(self.neck_width / self.paddle_diameter)
        angles = np.array([math.pi - half, math.pi + half, 2 * math.pi - half, 2 * math.pi + half, 3 * math.pi - half])
        square = INNER * radius * math.sqrt(0.5) * np.array([[-1, 1], [-1, -1], [1, -1], [1, 1], [-1, 1]])
        short = equal_parts(max(self.neck_width, INNER * radius * math.sqrt(2)), size)
        long = equal_parts(0.85 * radius * (math.pi - 2 * half), size)

        def taper(s: Array, t: Array) -> Array:
            width = self.root_width + s * (self.neck_width - self.root_width)
            return np.stack([self.taper_length * s, width / 2 * np.sin((2 * t - 1) * half) / math.sin(half)], axis=-1)

        def neck(s: Array, t: Array) -> Array:
            y = radius * np.sin((2 * t - 1) * half)
            end = middle - np.sqrt(radius**2 - y**2)
            return np.stack([self.taper_length + s * (end - self.taper_length), y], axis=-1)

        def on_circle(angle: Array | float) -> Array:
            return np.stack([middle + radius * np.cos(angle), radius * np.sin(angle)], axis=-1)

        def sector(k: int) -> Block:
            def place(s: Array, t: Array) -> Array:
                chord = np.array([middle, 0.0]) + square[k] + t[..., None] * (square[k + 1] - square[k])
                arc = on_circle(angles[k] + t * (angles[k + 1] - angles[k]))
                return np.asarray(chord + s[..., None] * (arc - chord))

            return Block(place, equal_parts((1 - INNER) * radius, size), long if k % 2 else short)

        def inside(s: Array, t: Array) -> Array:
            side = square[2, 0] - square[0, 0]
            return np.stack([middle + side * (s - 0.5), side * (t - 0.5)], axis=-1)

        straight = equal_parts(self.neck_length - self.taper_length, size)
        return [
            Block(taper, equal_parts(self.taper_length, size), short),
            Block(neck, straight, short),
            Block(inside, long, short),
            *(sector(k) for k in range(4)),
        ]


@dataclass(frozen=True)
class Ring:
    """A free annulus about the origin, or a disc where ``inner`` is 0 [m]."""

    inner: float
    outer: float

    @property
    def centre(self) -> tuple[float, float]:
        """Middle of its contact [m]."""
        return 0.0, 0.0

    def blocks(self, size: float) -> list[Block]:
        """Return four quarters of the rim, and a square inside of those of a disc."""
        square = INNER * self.outer * math.sqrt(0.5) * np.array([[1, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]])
        around = equal_parts(0.5 * math.pi * self.outer, size, 2)
        hole = self.inner or INNER * self.outer

        def quarter(k: int) -> Block:
            def place(s: Array, t: Array) -> Array:
                angle = math.pi / 2 * (k - 0.5 + t)
                ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
                chord = square[k] + t[..., None] * (square[k + 1] - square[k])
                near = self.inner * ray if self.inner else chord
                return np.asarray(near + s[..., None] * (self.outer * ray - near))

            return Block(place, equal_parts(self.outer - hole, size), around)

        def inside(s: Array, t: Array) -> Array:
            side = square[0, 0] - square[2, 0]
            return np.stack([side * (s - 0.5), side * (t - 0.5)], axis=-1)

        middle = [] if self.inner else [Block(inside, around, around)]
        return [*middle, *(quarter(k) for k in range(4))]


Outline = Sheet | Flapper | Ring
