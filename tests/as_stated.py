"""Bodies of a scene by the method that its file states, for tests that need no plan."""

from impact import Body, ContactProblem, GreensFunction
from impact.runs.variations import Values
from seatfem.structures.cache import Cache, build
from seatfem.structures.method import Method, Solved
from seatfem.study.impacts import bodies
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.touches import values_of_record
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene


def seat_of(
    scene: Scene, cache: Cache | None = None, *, method: Method | None = None, mesh_error: bool = True
) -> Solved:
    """Return the seat, by ``method`` where that is given."""
    how = stated_method(scene).seat if method is None else method
    return build(scene.seat, how, scene.run.duration, cache, mesh_error=mesh_error)


def solved_striker(scene: Scene, *, method: Method | None = None, mesh_error: bool = True) -> Solved | None:
    """Return the striker, by ``method`` where that is given; ``None`` for a closed form."""
    how = stated_method(scene).reed if method is None else method
    return bodies.solve_body("reed", scene.reed, how, scene.run.duration, mesh_error=mesh_error)


def striker_of(
    scene: Scene, n_modes: int | None = None, greens: GreensFunction | None = None, method: Method | None = None
) -> Body:
    """Return the striker with its motion and loads; ``method``: by which it is computed where ``greens`` is absent."""
    if greens is None and (solved := solved_striker(scene, method=method)) is not None:
        greens = solved.greens
    return bodies.striker_of(scene, n_modes, greens)


def values_of_problem(scene: Scene, problem: ContactProblem, dt: float) -> Values:
    """Return the values of a contact problem that is marched at steps ``dt`` [s]."""
    record = record_of(scene, problem, dt)
    return values_of_record(record, record.landings)
