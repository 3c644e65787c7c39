"""The errors of geometries and of everything that makes a finite-element model."""

from impact.notices import SeatfemError


class ModelError(SeatfemError, ValueError):
    """A mesh, material or matrix from which no model can be made; the message names object, number and remedy."""


class GeometryError(SeatfemError, ValueError):
    """A geometry that cannot be built; the message names the field, its value, the limit and the remedy.

    ``field``: dotted, of the geometry's specification; "" where none is to blame alone.
    """

    def __init__(self, message: str, field: str = "") -> None:
        super().__init__(message)
        self.field = field


class MeshError(SeatfemError, ValueError):
    """Error of an unusable mesh; the message names the source, the group, and the content of the mesh.

    ``problems``: pairs of the responsible argument of the reader ("" if there is none) and the message.
    """

    def __init__(self, message: str, *, field: str = "", problems: tuple[tuple[str, str], ...] = ()) -> None:
        super().__init__(message)
        self.problems = problems or ((field, message),)
