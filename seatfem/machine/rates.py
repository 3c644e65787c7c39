"""Times per unit of each kind of work [s], by which plans predict times and choose among methods.

They were fitted to runs on two cores of a server. The choices of a plan depend on their ratios, which hardly differ
between computers; a slower computer takes longer than predicted by about the same factor in all stages.
"""

from typing import Final

START: Final = 2.0  # start of the program, from the command to the first stage
COMPILED: Final = 0.12  # loading of compiled code from the cache at its first call
MESHING_START: Final = 0.17  # start of a gmsh process
ELEMENT: Final = 8.0e-5  # a tetrahedron of order 2, meshed, read and checked
ENTRY: Final = 6.5e-8  # an entry of a stiffness matrix, assembled
FACTOR_START: Final = 0.01  # fixed time of any factorization
FACTOR: Final = 9.0e-8  # a factorization, over unknowns^1.47
SOLVE: Final = 7.7e-9  # a solution with a factor, over unknowns^(4/3)
PRODUCT: Final = 1.13e-8  # an entry of the stiffness matrix, in all products that a Krylov vector takes
INNER: Final = 1.2e-9  # an unknown in the inner product of two Krylov vectors, twice
CHECK: Final = 6.0e-4  # the error estimate for each Krylov vector
POLE: Final = 1.7e-9  # a pole in one time step, integrated and evaluated again for the energies
STEP: Final = 2.2e-7  # a time step without its poles, with its measures
STRESS: Final = 2.5e-9  # a time step and mode of the reed, in the search for the largest stress
VALUE: Final = 5.9e-8  # a number written to a compressed file
SHEET: Final = 0.22  # a picture of curves
VIEW: Final = 0.12  # a picture of a body, rendered
FACE: Final = 1.2e-5  # a triangle of such a picture
