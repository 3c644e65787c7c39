"""Contact between bodies known by their driving-point Green's functions.

The names in `__init__.pyi` are loaded on first use: what reads a file or asks for a version does not wait for the
compiler.
"""

from impact.names import load_late, public_names

load_late(__name__)

__getattr__, __dir__, __all__ = public_names(
    __name__,
    __file__,
    former={
        "contact_stress": "impact.exact.contact_stress",
        "half_space": "impact.exact.half_space",
        "pekeris": "impact.exact.half_space",
        "rods": "impact.after.rods",
        "after.contact_stress": "impact.exact.contact_stress",
    },
)
