"""Regions of contact as points with areas: round lands of ports, and the lip around a kidney-shaped one."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from points.gll import Array

FINE = 720  # points around one land, from which the centroid is found


@dataclass(frozen=True)
class Cells:
    """Cells of one land, those across fastest: places (around, across, 2) and areas (around, across), in SI units."""

    places: Array
    areas: Array


class Land(ABC):
    """A flat face between two closed lines."""

    @abstractmethod
    def cells(self, around: int, across: int) -> Cells:
        """Return its cells: at Gauss' places across, anticlockwise around."""


@dataclass(frozen=True)
class RoundLand(Land):
    """A ring about ``centre``, from radius ``inner`` to ``outer`` [m]."""

    centre: tuple[float, float]
    inner: float
    outer: float

    def cells(self, around: int, across: int) -> Cells:
        radii, weights = _gauss(self.inner, self.outer, across)
        angles = 2 * np.pi * (np.arange(around) + 0.5) / around
        places = np.array(self.centre) + radii[:, None] * _rays(angles)[:, None]
        return Cells(places, np.tile(2 * np.pi / around * radii * weights, (around, 1)))


@dataclass(frozen=True)
class KidneyLand(Land):
    """What lies ``inner`` to ``outer`` [m] off an arc of radius ``bend`` over the angle 2 ``half`` [rad], whose centre is
    the origin and whose middle lies on the x axis."""

    bend: float
    half: float
    inner: float
    outer: float

    def cells(self, around: int, across: int) -> Cells:
        off, weights = _gauss(self.inner, self.outer, across)
        middle = (self.inner + self.outer) / 2
        lengths = np.array(
            [2 * self.half * (self.bend + middle), math.pi * middle, 2 * self.half * (self.bend - middle)]
        )
        whole = lengths.sum() + lengths[1]
        numbers = np.maximum(1, np.round(lengths / whole * around).astype(int))
        turn = _middles(-self.half, self.half, numbers[0])
        back = _middles(self.half, -self.half, numbers[2])
        caps = _middles(0.0, math.pi, numbers[1])
        ends = self.bend * _rays(np.array([self.half, -self.half]))
        spread = np.full((len(turn), 1), 2 * self.half / len(turn))
        wound = np.full((len(caps), 1), math.pi / len(caps))
        inwards = np.full((len(back), 1), 2 * self.half / len(back))
        parts = [
            ((self.bend + off)[:, None] * _rays(turn)[:, None], spread * (self.bend + off) * weights),
            (ends[0] + off[:, None] * _rays(self.half + caps)[:, None], wound * off * weights),
            ((self.bend - off)[:, None] * _rays(back)[:, None], inwards * (self.bend - off) * weights),
            (ends[1] + off[:, None] * _rays(-self.half + math.pi + caps)[:, None], wound * off * weights),
        ]
        return Cells(*(np.concatenate(each) for each in zip(*parts, strict=True)))


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

    def cells(self, around: int, across: int) -> list[Cells]:
        """Return the cells of every land from the common centroid."""
        each = (land.cells(around, across) for land in self.lands)
        return [Cells(one.places - self.centroid, one.areas) for one in each]


def _gauss(low: float, high: float, number: int) -> tuple[Array, Array]:
    x, weights = np.polynomial.legendre.leggauss(number)
    return (low + high) / 2 + (high - low) / 2 * x, (high - low) / 2 * weights


def _middles(start: float, end: float, number: int) -> Array:
    return np.asarray(start + (end - start) * (np.arange(number) + 0.5) / number)


def _rays(angles: Array) -> Array:
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)
