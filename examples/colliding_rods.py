"""
Two rods meet end to end
========================

Two equal free rods meet end to end: they part after one round trip 2 l/c and have swapped their velocities.

Saint-Venant's classical result; the contact force is Z V/2 throughout, Z = rho c A.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/colliding_rods.png"

import math

import impact
from impact import measures
from impact.pictures.plots import plot_motion

YOUNG, DENSITY, AREA, LENGTH, VELOCITY = 200e9, 7850.0, 1e-4, 0.1, 1.0
rod = impact.free_rod(young=YOUNG, density=DENSITY, area=AREA, length=LENGTH)
round_trip = 2 * LENGTH / math.sqrt(YOUNG / DENSITY)
impedance = AREA * math.sqrt(YOUNG * DENSITY)

striker, target = impact.Body(rod, velocity=-VELOCITY), impact.Body(rod)
result = impact.solve(impact.ContactProblem(striker, target), dt=round_trip / 200, duration=2 * round_trip)

(start, end), *others = measures.contact_intervals(result)
print(f"force {measures.peak_force(result):.3f} N, Z V/2 = {impedance * VELOCITY / 2:.3f} N")
print(f"contact {1e6 * (end - start):.3f} us, 2 l/c = {1e6 * round_trip:.3f} us")
print(f"restitution {measures.restitution(result):.12f}")

assert not others
assert abs(end - start - round_trip) < 1e-9 * round_trip
assert abs(measures.peak_force(result) / (impedance * VELOCITY / 2) - 1) < 1e-9
assert abs(measures.restitution(result) - 1) < 1e-9

plot_motion(result, None, "colliding_rods.png", title="Two equal free rods", names=("rod", ""))
