"""The verification table claims the literature's values."""

import json
from pathlib import Path

import numpy as np
import pytest

from seatfem.verification.beams import REED
from seatfem.verify import verification_cases

REFERENCES = {entry["id"]: entry for entry in json.loads(Path(__file__).with_name("references.json").read_text())}
CASES = {(case.case, case.quantity): case for case in verification_cases()}


def entry_value(name: str, part: int | str | None) -> float:
    entry = REFERENCES[name]
    if isinstance(part, str):
        return entry[part]
    return entry["value"] if part is None else entry["value"][part]


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
    ]


def paper_rod(entry: str, length: str, area: str) -> list[tuple[str, int, tuple[str, str]]]:
    quantities = ("impedance Z [N s/m]", "stiffness K [N/m]", "f_1 [Hz]", "round trip 2 l/c [s]")
    name = f"paper's rod, l = {length} mm, A = {area} m^2"
    return [(entry, part, (name, quantity)) for part, quantity in enumerate(quantities)]


SPHERE = "steel sphere, 5 mm radius, 1 m/s, on a rigid seat"
FLIGHT = "paper's reed released from 1 mm, damping ratio"
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
    *(pair for number in ("0", "0.1", "0.3", "0.5") for pair in plate(number)),
    *(("eb_cantilever_lambda", n, ("Euler-Bernoulli cantilever", f"k_{n + 1} L")) for n in range(6)),
    *(("paper_reed_freqs", n, ("paper's reed", f"f_{n + 1} [Hz]")) for n in range(6)),
    ("paper_reed_static", 2, ("paper's reed", "tip stiffness 3 EI/L^3 [N/m]")),
    ("paper_v_static_z0", 0, (f"{FLIGHT} 0", "first contact [s]")),
    ("paper_v_static_z0", 1, (f"{FLIGHT} 0", "closing velocity [m/s]")),
    ("paper_v_static_z3", 0, (f"{FLIGHT} 0.03", "first contact [s]")),
    ("paper_v_static_z3", 1, (f"{FLIGHT} 0.03", "closing velocity [m/s]")),
    *paper_rod("paper_rod_l3_thk", "3", "4.17e-09"),
    *paper_rod("paper_rod_l3_area", "3", "4.17e-07"),
    *paper_rod("paper_rod_l30_thk", "30", "4.17e-09"),
    *paper_rod("paper_rod_l30_area", "30", "4.17e-07"),
]


@pytest.mark.parametrize(("entry", "part", "key"), PAIRS, ids=[f"{e}-{p}" for e, p, _ in PAIRS])
def test_table_claims_the_reference(entry: str, part: int | str | None, key: tuple[str, str]) -> None:
    case, reference = CASES[key], entry_value(entry, part)
    # velocities of rebound and approach are stated with a sign there, as speeds here; 1e-9: the digits printed
    assert case.exact == pytest.approx(abs(reference), rel=1e-9)


def test_derived_constants_of_hertz() -> None:
    """The constants of the closed form give the sphere's entries."""
    mass, k = REFERENCES["hertz_steel_on_steel_mass"]["value"], REFERENCES["hertz_steel_on_steel_k"]["value"]
    scale = (mass**2 / k**2) ** 0.2  # V = 1 m/s
    duration = REFERENCES["hertz_steel_on_steel_T"]["value"]
    assert duration / scale == pytest.approx(REFERENCES["hertz_T_constant2"]["value"], rel=1e-7)
    deepest = REFERENCES["hertz_steel_on_steel_dmax"]["value"]
    assert duration / deepest == pytest.approx(REFERENCES["hertz_T_constant"]["value"], rel=1e-7)
    force = REFERENCES["hertz_F_constant"]["value"] * k**0.4 * mass**0.6
    assert force == pytest.approx(REFERENCES["hertz_steel_on_steel_Fmax"]["value"], rel=1e-7)


def test_static_root_stress_of_the_reed() -> None:
    """3 E h d/(2 L^2), from the moment of the tip force over the section modulus."""
    force = 1e-3 / REED.compliance(REED.length, REED.length)
    stress = force * REED.length / (REED.width * REED.thickness**2 / 6)
    assert stress == pytest.approx(REFERENCES["paper_static_root_stress"]["value"], rel=1e-7)


def test_every_value_is_a_number_with_a_source() -> None:
    for entry in REFERENCES.values():
        assert np.all(np.isfinite(entry["value"]))
        assert 0 < entry["rtol"] < 1e-2
        assert entry["source"]
