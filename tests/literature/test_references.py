"""The verification table claims the literature's values."""

import json
from pathlib import Path

import numpy as np
import pytest

from seatfem.verify import verification_cases

FILES = ("half_space.json", "beams.json", "references.json", "finite_elements.json")
REFERENCES = {entry["id"]: entry for f in FILES for entry in json.loads(Path(__file__).with_name(f).read_text())}
CASES = {(case.case, case.quantity): case for case in verification_cases()}


def fixed_rod(alpha: str, number: str) -> list[tuple[str, int | None, tuple[str, str]]]:
    name = f"rigid mass on a fixed rod, rod mass/mass = {number}"
    return [
        (f"rod_fixed_alpha_{alpha}_tend", None, (name, "end of contact, c t/l")),
        (f"rod_fixed_alpha_{alpha}_pmax", None, (name, "largest contact stress/(rho c V)")),
        (f"rod_fixed_alpha_{alpha}_smax", None, (name, "largest stress at the fixed end/(rho c V)")),
        (f"rod_fixed_alpha_{alpha}_vend", None, (name, "rebound velocity at separation/V")),
    ]


def plate(number: str) -> list[tuple[str, str | None, tuple[str, str]]]:
    name = f"sphere on an infinite plate, lambda = {number}"
    return [
        (f"zener_lam_{number}", None, (name, "rebound velocity/V")),
        (f"zener_lam_{number}", "tau_c", (name, "contact duration (k^2 V/m^2)^(1/5)")),
        (f"zener_lam_{number}", "smax", (name, "largest approach (k^2/(m^2 V^4))^(1/5)")),
    ]


def paper_rod(entry: str, length: str, area: str) -> list[tuple[str, int, tuple[str, str]]]:
    quantities = ("impedance Z [N s/m]", "stiffness K [N/m]", "f_1 [Hz]", "round trip 2 l/c [s]")
    name = f"paper's rod, l = {length} mm, A = {area} m^2"
    return [(entry, part, (name, quantity)) for part, quantity in enumerate(quantities)]


def mode_flight(entry: str, damping_ratio: str) -> list[tuple[str, int, tuple[str, str]]]:
    name = f"paper's reed released in its first mode, damping ratio {damping_ratio}"
    return [(entry, 0, (name, "first contact [s]")), (entry, 1, (name, "closing velocity [m/s]"))]


def round_plate(entry: str, case: str) -> list[tuple[str, str, tuple[str, str]]]:
    name = f"round {case}, thin"
    quantities = [
        (part, f"lambda^2, {part.split(',')[0]} nodal diameters, mode {part.split(',')[1]}")
        for part in REFERENCES[entry]["value"]
    ]
    return [(entry, part, (name, quantity)) for part, quantity in quantities]


def square_plate(about_x: str, about_y: str, *parts: str) -> list[tuple[str, str, tuple[str, str]]]:
    name = f"free square plate (FV12), {about_x} about x, {about_y} about y, thin"
    values = REFERENCES["nafems_FV12"]["value"]
    return [("nafems_FV12", part, (name, f"f = {values[part]:g} Hz")) for part in parts]


def several(entry: str, case: str, *quantities: str) -> list[tuple[str, int, tuple[str, str]]]:
    return [(entry, part, (case, quantity)) for part, quantity in enumerate(quantities)]


SPHERE = "steel sphere, 5 mm radius, 1 m/s, on a rigid seat"
HERTZ = "sphere on a rigid seat, constants of Hertz"
STATIC = "half-space, static load"
RAYLEIGH = "half-space, Rayleigh wave"
STEP = "half-space, disk load that stays"
CIRCLE, DISK = "circular Hertz contact, nu = 0.3", "uniform pressure on a disk, nu = 0.3"
TIP = "beam's free tip given the velocity v"
FLIGHT = "paper's reed released from 1 mm, damping ratio"
LINES = "plate theory's value: w = 0 along lines does not hold a solid, its frequencies fall with every finer mesh"
LEFT_OUT = {("nafems_FV52", mode): LINES for mode in "4579"}
PAIRS = [
    *fixed_rod("1", "1"),
    *fixed_rod("1_4", "0.25"),
    ("rod_free_alpha_0.5", None, ("rigid mass on a free rod, rod mass/mass = 0.5", "restitution of the mass centres")),
    ("rod_semiinf_decay", None, ("rigid mass M on a semi-infinite rod", "N/(Z V) at Z t/M = 1")),
    ("rod_rod_identical", None, ("identical rods", "contact time, c t/l")),
    ("rod_rod_impedance", None, ("rods of impedance 1 and 3 before any reflection", "N/V")),
    ("hertz_steel_on_steel_T", None, (SPHERE, "contact duration [s]")),
    ("hertz_steel_on_steel_Fmax", None, (SPHERE, "largest force [N]")),
    ("hertz_steel_on_steel_dmax", None, (SPHERE, "largest penetration [m]")),
    ("hertz_T_constant", None, (HERTZ, "duration V/largest penetration")),
    ("hertz_T_constant2", None, (HERTZ, "duration (k^2 V/m^2)^(1/5)")),
    ("hertz_F_constant", None, (HERTZ, "largest force/(k^(2/5) m^(3/5) V^(6/5))")),
    ("hertz_steel_on_steel_mass", None, (SPHERE, "mass [kg]")),
    ("hertz_steel_on_steel_k", None, (SPHERE, "k of N = k d^(3/2) [N/m^(3/2)]")),
    ("hertz_steel_on_steel_contact", None, (SPHERE, "largest contact radius [m]")),
    ("hertz_steel_on_steel_p0", None, (SPHERE, "largest pressure [Pa]")),
    *several("hertz_taumax_nu0.3", CIRCLE, "largest shear/p0", "its depth/a"),
    ("hertz_edge_tension", None, (CIRCLE, "radial tension at the edge/p0")),
    *several("hertz_line_taumax", "Hertz line contact", "largest shear/p0", "its depth/b"),
    *several("disk_taumax_nu0.3", DISK, "largest shear on the axis/p", "its depth/a"),
    ("boussinesq_disk_mean", None, (STATIC, "disk, mean w E/((1 - nu^2) p a)")),
    ("boussinesq_disk_mean_F", None, (STATIC, "disk, mean w E a/((1 - nu^2) F)")),
    ("boussinesq_disk_centre_edge", 0, (STATIC, "disk, centre w E/((1 - nu^2) p a)")),
    ("boussinesq_disk_centre_edge", 1, (STATIC, "disk, edge w E/((1 - nu^2) p a)")),
    ("boussinesq_square_mean", None, (STATIC, "square, mean w E/((1 - nu^2) p b)")),
    ("boussinesq_square_centre", None, (STATIC, "square, centre w E/((1 - nu^2) p b)")),
    ("punch_rigid_disk", None, (STATIC, "rigid round punch, w E a/((1 - nu^2) F)")),
    *(
        (f"pekeris_tau_{tau}", None, ("half-space, point load that stays", f"w pi mu r/F at c_s t/r = {tau}"))
        for tau in ("0.6", "0.95", "1.02", "1.08", "1.2")
    ),
    ("rayleigh_nu0.25", None, (RAYLEIGH, "c_R/c_s, nu = 0.25")),
    *(
        (f"rayleigh_cR_nu{nu}", None, (RAYLEIGH, f"c_R/c_s, nu = {'0.3333' if nu == '0.333' else nu}"))
        for nu in ("0", "0.25", "0.29", "0.3", "0.333", "0.49")
    ),
    ("pochhammer_limit", None, (RAYLEIGH, "c_R/c_0, nu = 0.29")),
    *(
        ("halfspace_disk_step", tau, (STEP, f"mean u/u_static at c_s t/a = {float(tau):g}"))
        for tau in REFERENCES["halfspace_disk_step"]["value"]
    ),
    ("halfspace_disk_slope", None, (STEP, "u'(0+) rho c_p pi a^2/F")),
    *several("eb_tip_velocity_step_moment", TIP, "largest moment/(v (EI rho A)^(1/2))", "its place x/(a t)^(1/2)"),
    ("eb_tip_velocity_step_stress", None, (TIP, "largest surface stress/(rho c_0 v)")),
    ("eb_tip_impedance", None, (TIP, "F (2 pi a t)^(1/2)/(v (EI rho A)^(1/2))")),
    (
        "eb_tip_kernel_small_t",
        None,
        ("cantilever's tip, early", "modal g/2 (2 a t/pi)^(1/2) (EI rho A)^(1/2) at a t/L^2 = 1e-3"),
    ),
    *(("eb_clamped_clamped_lambda2", n, ("clamped-clamped beam", f"(k_{n + 1} L)^2")) for n in range(3)),
    *(("eb_tip_mass_1_lambda2", n, ("cantilever, tip mass = beam's mass", f"(k_{n + 1} L)^2")) for n in range(5)),
    *(("timo_cantilever_Lh10", n, ("Timoshenko cantilever, L/h = 10", f"f_{n + 1} [Hz]")) for n in range(5)),
    *(pair for number in ("0", "0.1", "0.3", "0.5") for pair in plate(number)),
    *(("eb_cantilever_lambda", n, ("Euler-Bernoulli cantilever", f"k_{n + 1} L")) for n in range(6)),
    *(("paper_reed_freqs", n, ("paper's reed", f"f_{n + 1} [Hz]")) for n in range(6)),
    ("paper_reed_static", 0, ("paper's reed, static", "mass [kg]")),
    ("paper_reed_static", 1, ("paper's reed, static", "EI [N m^2]")),
    ("paper_reed_static", 2, ("paper's reed", "tip stiffness 3 EI/L^3 [N/m]")),
    ("paper_reed_static", 3, ("paper's reed, static", "tip force for 1 mm [N]")),
    ("paper_static_root_stress", None, ("paper's reed, static", "root stress for 1 mm, 3 E h d/(2 L^2) [Pa]")),
    *mode_flight("paper_v_mode1_z0", "0"),
    *mode_flight("paper_v_mode1_z3", "0.03"),
    ("paper_v_static_z0", 0, (f"{FLIGHT} 0", "first contact [s]")),
    ("paper_v_static_z0", 1, (f"{FLIGHT} 0", "closing velocity [m/s]")),
    ("paper_v_static_z3", 0, (f"{FLIGHT} 0.03", "first contact [s]")),
    ("paper_v_static_z3", 1, (f"{FLIGHT} 0.03", "closing velocity [m/s]")),
    *paper_rod("paper_rod_l3_thk", "3", "4.17e-09"),
    *paper_rod("paper_rod_l3_area", "3", "4.17e-07"),
    *paper_rod("paper_rod_l30_thk", "30", "4.17e-09"),
    *paper_rod("paper_rod_l30_area", "30", "4.17e-07"),
    *round_plate("circ_plate_C_nu0.3", "clamped plate"),
    *round_plate("circ_plate_S_nu0.3", "simply supported plate"),
    *round_plate("annular_FF_0.5", "ring, b/a = 0.5, free outside, free inside"),
    *round_plate("annular_CC_0.5", "ring, b/a = 0.5, clamped outside, clamped inside"),
    *round_plate("annular_SF_0.5", "ring, b/a = 0.5, simply supported outside, free inside"),
    *(("sphere_radial_nu0.3", n, ("free sphere, nu = 0.3", f"w a/c_p, breathing mode {n + 1}")) for n in range(3)),
    ("nafems_FV52", "8", ("thick square plate (FV52) of quadratic hexahedra", "f_8, in plane [Hz]")),
    *square_plate("antisymmetric", "antisymmetric", "7"),
    *square_plate("symmetric", "symmetric", "8", "9", "14"),
    *square_plate("symmetric", "antisymmetric", "10", "12"),
    *(("nafems_FV32", n, ("tapered membrane (FV32), plane stress", f"f_{n + 1} [Hz]")) for n in range(6)),
]


@pytest.mark.parametrize(("entry", "part", "key"), PAIRS, ids=[f"{e}-{p}" for e, p, _ in PAIRS])
def test_table_claims_the_reference(entry: str, part: int | str | None, key: tuple[str, str]) -> None:
    case, stated = CASES[key], REFERENCES[entry]
    values = stated if isinstance(part, str) and part in stated else stated["value"]
    reference = values if part is None else values[part]
    if entry.endswith("vend") or entry.startswith("paper_v_"):
        reference = abs(reference)  # velocities of rebound and approach are stated with a sign there, as speeds here
    assert case.exact == pytest.approx(reference, rel=1e-9)  # the digits printed


def parts(entry: dict[str, object]) -> set[int | str | None]:
    """Return the numbers that an entry states."""
    value = entry["value"]
    more = {key for key in ("tau_c", "smax") if key in entry}
    return more | (
        set(value) if isinstance(value, dict) else set(range(len(value))) if isinstance(value, list) else {None}
    )


def test_every_number_is_claimed() -> None:
    claimed = {(entry, part) for entry, part, _ in PAIRS}
    assert not claimed & set(LEFT_OUT)
    assert claimed | set(LEFT_OUT) == {(name, part) for name, entry in REFERENCES.items() for part in parts(entry)}


def test_every_value_is_a_number_with_a_source() -> None:
    for entry in REFERENCES.values():
        value = entry["value"]
        assert np.all(np.isfinite(list(value.values()) if isinstance(value, dict) else value))
        assert 0 < entry["rtol"] < 1e-2
        assert entry["source"]
