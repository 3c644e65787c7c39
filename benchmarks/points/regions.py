"""Regions of contact as points with areas: round lands of ports, the lip around a kidney-shaped one, rectangles."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from points.gll import Array

THIN = 1e-6  # share of its distance of a land that stands for a line
FINE = 720  # points around one land, from which the centroid is found


@dataclass(frozen=True)
class Cells:
    """Cells of one land: places (around, across, 2), areas (around, across), lengths (around,) along its middle; SI."""

    places: Array
    areas: Array
    lengths: Array


class Land(ABC):
    """A flat face between two closed lines."""

    @abstractmethod
    def rims(self, number: int) -> Array:
        """Return about this number of places (n, 2) on both lines."""

    @abstractmethod
    def cells(self, around: int, across: int) -> Cells:
        """Return its cells: at Gauss' places across, anticlockwise around."""


@dataclass(frozen=True)
class RoundLand(Land):
    """A ring about ``centre``, from radius ``inner`` to ``outer`` [m]."""

    centre: tuple[float, float]
    inner: float
    outer: float

    def rims(self, number: int) -> Array:
        rays = _rays(_middles(2 * math.pi, number))
        return np.array(self.centre) + np.concatenate([self.inner * rays, self.outer * rays])

    def cells(self, around: int, across: int) -> Cells:
        radii, weights = _gauss(self.inner, self.outer, across)
        angles = 2 * np.pi * (np.arange(around) + 0.5) / around
        places = np.array(self.centre) + radii[:, None] * _rays(angles)[:, None]
        areas = np.tile(2 * np.pi / around * radii * weights, (around, 1))
        return Cells(places, areas, np.full(around, np.pi / around * (self.inner + self.outer)))


@dataclass(frozen=True)
class Rectangle(Land):
    """A rectangle between the corners ``low`` and ``high`` [m]; its cells follow each other along x."""

    low: tuple[float, float]
    high: tuple[float, float]

    def rims(self, number: int) -> Array:
        return np.array([[x, y] for x in (self.low[0], self.high[0]) for y in (self.low[1], self.high[1])])

    def cells(self, around: int, across: int) -> Cells:
        (begin, right), (end, left) = self.low, self.high
        y, weights = _gauss(right, left, across)
        x = begin + (end - begin) * (np.arange(around) + 0.5) / around
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        part = (end - begin) / around
        return Cells(places, np.tile(part * weights, (around, 1)), np.full(around, part))


@dataclass(frozen=True)
class KidneyLand(Land):
    """What lies ``inner`` to ``outer`` [m] off an arc of radius ``bend`` over the angle 2 ``half`` [rad].

    The arc's centre is the origin, its middle lies on the x axis."""

    bend: float
    half: float
    inner: float
    outer: float

    def rims(self, number: int) -> Array:
        thin = (replace(self, inner=off * (1 - THIN), outer=off * (1 + THIN)) for off in (self.inner, self.outer))
        return np.concatenate([each.cells(number, 1).places[:, 0] for each in thin])

    def cells(self, around: int, across: int) -> Cells:
        off, weights = _gauss(self.inner, self.outer, across)
        middle = (self.inner + self.outer) / 2
        angle = 2 * self.half
        lines = (angle * (self.bend + middle), math.pi * middle, angle * (self.bend - middle))  # with two round ends
        numbers = [max(1, round(line / (sum(lines) + lines[1]) * around)) for line in lines]
        ahead, wound, back = (
            _middles(turn, number) for turn, number in zip((angle, math.pi, angle), numbers, strict=True)
        )
        end = self.bend * _rays(np.array([self.half, -self.half]))
        ends = (
            off[:, None] * _rays(self.half + wound)[:, None],
            off[:, None] * _rays(math.pi - self.half + wound)[:, None],
        )
        parts = (
            ((self.bend + off)[:, None] * _rays(ahead - self.half)[:, None], self.bend + off, angle, numbers[0]),
            (end[0] + ends[0], off, math.pi, numbers[1]),
            ((self.bend - off)[:, None] * _rays(self.half - back)[:, None], self.bend - off, angle, numbers[2]),
            (end[1] + ends[1], off, math.pi, numbers[1]),
        )
        places = np.concatenate([part[0] for part in parts])
        areas = [np.tile(turn / number * radii * weights, (number, 1)) for _, radii, turn, number in parts]
        pairs = zip((*lines, lines[1]), (*numbers, numbers[1]), strict=True)
        lengths = [np.full(number, line / number) for line, number in pairs]
        return Cells(places, np.concatenate(areas), np.concatenate(lengths))


@dataclass(frozen=True)
class Region:
    """Lands that are struck together; places count from their common centroid."""

    lands: Sequence[Land]

    @cached_property
    def centroid(self) -> Array:
        """The (2,) centroid in the coordinates of the lands [m]."""
        cells = [land.cells(FINE, 3) for land in self.lands]
        areas = sum(each.areas.sum() for each in cells)
        return np.asarray(sum((each.places * each.areas[..., None]).sum(axis=(0, 1)) for each in cells) / areas)

    def rims(self, number: int) -> list[Array]:
        """Return places (n, 2) on the rims of every land from the common centroid."""
        return [land.rims(number) - self.centroid for land in self.lands]

    def cells(self, around: int, across: int) -> list[Cells]:
        """Return the cells of every land from the common centroid."""
        each = self.drawn_cells(around, across)
        return [Cells(one.places - self.centroid, one.areas, one.lengths) for one in each]

    def drawn_cells(self, around: int, across: int) -> list[Cells]:
        """Return the cells of every land in the coordinates of the lands."""
        return [land.cells(around, across) for land in self.lands]


def _gauss(low: float, high: float, number: int) -> tuple[Array, Array]:
    x, weights = np.polynomial.legendre.leggauss(number)
    return (low + high) / 2 + (high - low) / 2 * x, (high - low) / 2 * weights


def _middles(turn: float, number: int) -> Array:
    """Return the middles (number,) of equal parts of 0 to ``turn``."""
    return np.asarray(turn * (np.arange(number) + 0.5) / number)


def _rays(angles: Array) -> Array:
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)
