"""Problems with a known answer, each solved by the public functions; `seatfem verify` runs them."""

from __future__ import annotations

from collections.abc import Callable

from seatfem.verify import Case

from .bars import bar_cases
from .beams import beam_cases
from .compliant import compliant_cases, several_cases
from .ground import ground_cases, rigid_face_cases
from .half_space import half_space_cases, radiating_cases
from .lumped import lumped_cases
from .manufactured import manufactured_cases
from .plates import plate_cases
from .reeds import reed_cases
from .rods import rod_cases
from .round_bars import round_bar_cases
from .solids import finite_element_cases, solid_cases
from .spheres import sphere_cases
from .stresses import stress_cases
from .thick_plates import thick_plate_cases
from .waves import wave_cases

# To add rows: a function that returns cases, here. Making the cases is cheap; only `Case.compute` works.
PROVIDERS: tuple[Callable[[], tuple[Case, ...]], ...] = (
    rod_cases,
    wave_cases,
    bar_cases,
    lumped_cases,
    several_cases,
    compliant_cases,
    radiating_cases,
    half_space_cases,
    stress_cases,
    beam_cases,
    reed_cases,
    finite_element_cases,
    manufactured_cases,
    solid_cases,
    sphere_cases,
    round_bar_cases,
    ground_cases,
    rigid_face_cases,
    plate_cases,
    thick_plate_cases,
)
