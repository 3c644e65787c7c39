"""
A rod against its spring
========================

A rigid mass strikes a fixed rod, and a spring of the rod's static stiffness: what the spring leaves out.

In units of the rod (Z = rho c A = 1, l/c = 1, K = E A/l = 1). Exact values: Timoshenko & Goodier, Theory of
Elasticity, longitudinal impact of bars; the spring's contact lasts pi sqrt(m/K) and returns all the energy.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/rod_against_spring.png"

import math

import impact
from impact import measures
from impact.pictures.drawing import sheet

STEP = 1 / 1000
EXACT = {1.0: (3.067667642, 2.135335283, 0.687618940), 0.25: (5.899590440, 2.974410101, 0.816911552)}

rod = impact.fixed_rod(young=1.0, density=1.0, area=1.0, length=1.0)
spring = impact.spring(stiffness=1 / rod.static_compliance()[0, 0])

runs: dict[float, dict[str, impact.ImpactResult]] = {}
for ratio, (end, peak, rebound) in EXACT.items():  # of the rod's mass to the striker's
    mass = 1 / ratio
    found, runs[ratio] = {}, {}
    for name, seat in (("rod", rod), ("spring", spring)):
        striker = impact.rigid_mass(mass=mass, velocity=-1.0)
        result = impact.solve(impact.ContactProblem(striker, impact.Body(seat)), dt=STEP, duration=2 * end)
        runs[ratio][name] = result
        parting = measures.contact_intervals(result)[0, 1]  # the rod, still ringing, touches once more later
        impulse = result.force[result.time <= parting].sum() * result.dt
        found[name] = (parting, measures.peak_force(result), -1.0 + impulse / mass)
        print(f"rod mass/mass {ratio:4.2f}, {name:6s}: c t/l {found[name][0]:.3f}", end=", ")
        print(
            f"peak {found[name][1]:.4f} Z V, rebound {found[name][2]:.4f} V, energy left {result.energy.residual:.0e}"
        )

    # the step is first order where the force jumps, measured 1 to 3 STEP; contact ends at a whole step
    half_period = math.pi * math.sqrt(mass)
    for name, expected in (("rod", (end, peak, rebound)), ("spring", (half_period, math.sqrt(mass), 1.0))):
        assert all(abs(f - e) < 4 * STEP for f, e in zip(found[name], expected, strict=True))
    assert found["spring"][1] < 0.7 * found["rod"][1]  # a spring sees neither the first jump nor its return

with sheet("rod_against_spring.png", 7.2, 3.2) as figure:
    for place, (ratio, both) in enumerate(runs.items()):
        axes = figure.add_subplot(1, 2, place + 1, xlabel="c t/l", title=f"rod mass/mass = {ratio:g}")
        for name, result in both.items():
            axes.plot(result.time, result.force, label=name)
        axes.set_ylabel("force/(Z V)")
        axes.legend()
