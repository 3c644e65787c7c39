"""From the geometry of a seat to its Green's function, and the application around it.

The names in `__init__.pyi` are loaded on first use, so that `import seatfem` costs nothing.
"""

from impact.names import load_late, public_names

load_late(__name__)

FORMER = {"geometry": "seatfem.structures.shapes", "revolve": "seatfem.pictures.skins:skin_of"}
__getattr__, __dir__, __all__ = public_names(__name__, __file__, former=FORMER)
