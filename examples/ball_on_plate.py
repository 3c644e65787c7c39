"""
A ball on plates
================

A steel ball on steel plates of three thicknesses: what the plate carries away, after Zener (1941).

An infinite plate answers a point force like a dashpot Z = 8 sqrt(D rho h), so a single number decides the rebound:
lambda = m/(Z T), T = (m^2/(k^2 V))^(1/5), k the Hertz stiffness. Zener's restitution is asserted for three of them.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/ball_on_plate.png"

import math

import impact
from impact import measures
from impact.pictures.drawing import sheet

YOUNG, POISSON, DENSITY = 200e9, 0.3, 7850.0
RADIUS, VELOCITY = 5e-3, 1.0
RESTITUTION = {0.1: 0.84333941, 0.3: 0.60594666, 0.5: 0.43689530}  # of lambda

mass = DENSITY * 4 / 3 * math.pi * RADIUS**3
stiffness = 4 / 3 * YOUNG / (2 * (1 - POISSON**2)) * math.sqrt(RADIUS)
time = (mass**2 / (stiffness**2 * VELOCITY)) ** 0.2

runs = {}
for inelasticity, exact in RESTITUTION.items():
    impedance = mass / (inelasticity * time)
    thickness = math.sqrt(impedance / 8 * math.sqrt(12 * (1 - POISSON**2) / (YOUNG * DENSITY)))
    plate = impact.infinite_plate(young=YOUNG, poisson=POISSON, density=DENSITY, thickness=thickness)
    ball = impact.rigid_mass(mass=mass, velocity=-VELOCITY)
    problem = impact.ContactProblem(ball, impact.Body(plate), law=impact.Hertz(stiffness=stiffness))
    result = impact.solve(problem, dt=time / 2000, duration=6 * time)
    runs[thickness] = result
    rebound = measures.impulse(result) / (mass * VELOCITY) - 1
    print(
        f"plate {1e3 * thickness:5.2f} mm, lambda {inelasticity}: rebound {rebound:.4f} V, Zener {exact:.4f}", end=", "
    )
    print(f"peak {measures.peak_force(result):.0f} N")
    assert abs(rebound - exact) < 1e-3  # first order in the step: 0.5 to 0.9 of dt/time

with sheet("ball_on_plate.png", 6.4, 3.4) as figure:
    axes = figure.add_subplot(xlabel="time [µs]", ylabel="force [N]", title="A thin plate takes a softer blow")
    for thickness, result in runs.items():
        axes.plot(1e6 * result.time, result.force, label=f"plate of {1e3 * thickness:.1f} mm")
    axes.legend()
