"""The loads of a scene's [[load]] tables, on the modes of its striker."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from impact.bodies.body import Body, Load
from seatfem.structures.kinds.plate_loads import constant, scaled
from seatfem.study.impacts.base import on_its_base
from seatfem.study.impacts.gas import gas_loads
from seatfem.study.impacts.springs import on_its_springs
from seatfem.study.scene import Scene
from seatfem.study.scene.external import ExternalLoad


def loaded(scene: Scene, body: Body) -> Body:
    """Return the striker's ``body`` under the scene's loads and its gas, beside the loads that it has, on its base and
    its valve springs. Raises as `Body`, `on_its_base` and `on_its_springs`."""
    if scene.load or scene.gas is not None:
        body = replace(body, loads=(*body.loads, *_loads(scene, body), *gas_loads(scene, body)))
    return on_its_springs(scene, on_its_base(scene, "reed", body))


def crank_of(scene: Scene) -> tuple[float, float] | None:
    """Return the speed of the crank [1/min] and its angle at t = 0 [rad], of the gas or else of the first load."""
    if scene.gas is not None:
        return scene.gas.rpm, scene.gas.angle
    courses = (course for load in scene.load for course in (load.pressure, load.force) if course is not None)
    return next(((course.rpm, course.angle or 0.0) for course in courses if course.rpm is not None), None)


def _loads(scene: Scene, body: Body) -> Iterator[Load]:
    for load in scene.load:
        if load.pressure is not None:
            yield _blown(scene, load, body)
        elif load.force is not None:
            place = load.at if load.point is None else np.array([load.point])
            yield Load(scene.reed.pushed_at(body, place).ravel(), load.force.course)
        else:
            shape, mass = scene.reed.weight(body)
            if load.gravity is not None:
                yield Load(shape, scaled(constant(load.gravity), mass))
            if load.base_motion is not None:
                yield Load(shape, scaled(load.base_motion.course, -mass))


def _blown(scene: Scene, load: ExternalLoad, body: Body) -> Load:
    """Return the load of a pressure, p(t) A(0), and its change with the lift, A/A(0): 1 for a constant area."""
    assert load.pressure is not None
    assert load.area is not None
    area, closed = load.area, load.area(0.0)
    by_opening = (lambda opening: area(opening) / closed) if load.by_lift else None
    return Load(scene.reed.blown(body), scaled(load.pressure.course, closed), by_opening)
