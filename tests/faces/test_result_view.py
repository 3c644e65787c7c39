"""What a run prints of its numbers: one sentence, and a table with error bars, differences and targets."""

from io import StringIO

import pytest
from rich.console import Console

from seatfem.faces.result_table import result_table
from seatfem.faces.verdict import difference, lasting, simpler, verdict

PEAK, IMPULSE = "filtered_peak_force_N", "impulse_Ns"
RUN: dict[str, object] = {
    PEAK: 50.0,
    "spring_" + PEAK: 40.0,
    "error_bar_" + PEAK: 0.5,
    IMPULSE: 1e-3,
    "spring_" + IMPULSE: 1.0005e-3,
    "error_bar_" + IMPULSE: 1e-6,
    "filter_width_s": 2e-6,
    "time_step_s": 25e-9,
    "first_contact_s": 5e-4,
    "spring_first_contact_s": 5e-4,
    "contact_count": 2,
    "spring_contact_count": 3,
    "restitution": 0.85,
    "spring_restitution": 0.87,
    "max_seat_displacement_m": 1e-6,
    "spring_max_seat_displacement_m": 2e-6,
    "error_bar_max_seat_displacement_m": 1e-8,
    "peak_force_N": 150.0,
    "spring_peak_force_N": 70.0,
    "energy_residual": 1e-12,
    "accuracy_target": 0.02,
    "accuracy_measures": "impulse, filtered_peak",
    "accuracy_met": True,
    "plan_seat_level": "axisymmetric",
    "plan_given": "run.duration",
    "seat_kind": "annular",
    "error_unknown": "",
}


def printed(**changed: object) -> list[str]:
    console = Console(width=120, record=True, file=StringIO())
    console.print(result_table({**RUN, **changed}))
    return [" ".join(line.split()) for line in console.export_text().splitlines()]


def row(words: str, **changed: object) -> str:
    return next(line for line in printed(**changed) if line.startswith(words))


def test_value_bar_spring_difference_and_target_stand_in_one_row() -> None:
    assert row("peak, 2 us mean") == "peak, 2 us mean 50.00 ± 0.50 N 40.00 N -20 % 20 1 %, met"
    assert row("impulse") == "impulse 1.0000 ± 0.0010 mN s 1.0005 mN s +0.05 % 0.5 0.1 %, met"
    assert row("peak, 2 us mean", **{"error_bar_" + PEAK: 1.5}).endswith("3 %, missed")
    assert row("restitution") == "restitution, first blow 0.85 0.87"


def test_of_several_blows_the_first_and_the_hardest_are_told() -> None:
    hardest = {"peak_time_s": 8.3e-3, "hardest_blow": 3, "hardest_blow_duration_s": 16e-6}
    hardest |= {"contact_duration_s": 835e-6, "hardest_blow_restitution": 0.7}
    lines = printed(**hardest, contact_count=4, first_contact_s=0.0)
    assert lines[lines.index(row("peak, 2 us mean", **hardest)) + 1 :][:2] == ["when 8.3 ms -", "in blow number 3 -"]
    assert "first contact, closed at the start 0 us 500 us" in lines
    assert lines[lines.index("contact duration, first blow 835 us -") + 1] == "hardest blow 16 us -"
    assert lines[lines.index("restitution, first blow 0.85 0.87") + 1] == "hardest blow 0.7 -"
    alone = printed(**hardest, contact_count=1)
    assert "contact duration 835 us -" in alone
    assert not any("blow" in line for line in alone)


def test_what_depends_on_the_step_stands_last_and_says_so() -> None:
    lines = printed()
    raw = lines.index("raw, step 25 ns")
    assert [line.split()[0] for line in lines[raw + 1 : raw + 2]] == ["peak"]
    assert all(lines.index(line) < raw for line in lines if line.startswith(("impulse", "restitution", "contacts")))
    assert row("seat displacement").endswith(" 1.000 ± 0.010 um 2.000 um, raw")  # of the spring: its raw force


def test_an_unknown_source_of_error_is_named() -> None:
    told = " ".join(printed(error_unknown="mesh, time_step"))
    assert "error bars leave out what is unknown: mesh, the time step (time_step)" in told
    assert any("error bars leave out what is unknown: mesh" in line for line in printed(error_unknown="mesh"))


def test_stress_after_the_first_touch_replaces_the_largest_of_all() -> None:
    old = {"peak_reed_stress_Pa": 2e8, "spring_peak_reed_stress_Pa": 2e8}
    new = {"peak_reed_stress_after_contact_Pa": 9e7, "initial_reed_stress_Pa": 2e8}
    assert row("reed stress, largest", **old) == "reed stress, largest 200 MPa 200 MPa"
    lines = printed(**old, **new)
    assert "reed stress, struck 90 MPa -" in lines
    assert "reed stress, before 200 MPa -" in lines
    assert not any(line.startswith("reed stress, largest") for line in lines)


def test_a_difference_beyond_the_bars_is_told_with_sign_and_size() -> None:
    assert verdict(RUN) == (
        "A constant stiffness would be 20 % low in the peak force (mean over 2 us) here, 20 error bars."
    )
    both = verdict({**RUN, "spring_" + IMPULSE: 1.01e-3})
    assert both.endswith("here, 20 error bars; and 1 % high in the impulse, 10 error bars.")


def test_below_the_bars_a_spring_serves() -> None:
    near = {**RUN, "spring_" + PEAK: 50.4}
    assert verdict(near) == (
        "Here a spring serves: the difference in impulse and peak force (mean over 2 us) is below the error bar "
        "(0.8 % against 1 % at most)."
    )
    wide = verdict({**RUN, "error_bar_" + PEAK: 20.0, "accuracy_met": False})
    assert wide.startswith("Whether a spring would serve cannot be told")


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"plan_seat_level": "spring", "accuracy_met": False},
            "The plan took the seat for its static stiffness, a spring",
        ),
        ({"plan_seat_level": "spring", "accuracy_met": True}, "Here a spring of the right stiffness serves. The plan"),
        (
            {"plan_seat_level": "spring", "ports": 32},
            "Here a spring of the right stiffness serves. The plan took the seat for its static stiffness, which its",
        ),
        (
            {"plan_seat_level": "spring", "ports": 32, "plan_given": "seat.model"},
            "seat.model = 'spring': the seat is its static stiffness alone, which its arcs share",
        ),
        ({"plan_seat_level": "spring", "plan_given": "seat.model, run.duration"}, "seat.model = 'spring'"),
        ({"seat_kind": "spring"}, "The seat is a spring: it is its own baseline."),
        ({"first_contact_s": None}, "No contact within run.duration"),
    ],
)
def test_seat_and_spring_alike_by_choice_is_said(changed: dict[str, object], words: str) -> None:
    assert verdict({**RUN, **changed}).startswith(words)


def test_a_plan_that_took_the_spring_vouches_for_what_was_asked_alone() -> None:
    """Its seat has no waves, which other measures may need."""
    assert row("seat displacement", plan_seat_level="spring") == "seat displacement 1 um 2 um, raw"
    assert "±" in row("impulse", plan_seat_level="spring")
    assert "margin on stress 1.350 ± 0.050" in " ".join(printed(**LIFE, plan_seat_level="spring"))


def test_measures_asked_for_decide_and_others_do_not() -> None:
    """The stress was asked for: the peak's difference is not the answer."""
    stress = "peak_reed_stress_after_contact_Pa"
    asked = {
        **RUN, "accuracy_measures": "stress", stress: 1e8, f"spring_{stress}": 1.001e8, f"error_bar_{stress}": 1e6
    }  # fmt: skip
    assert verdict(asked).startswith("Here a spring serves: the difference in reed stress after the first touch")


def test_nothing_to_compare_where_seat_or_bar_is_missing() -> None:
    assert difference(RUN, "peak_force_N") is None
    assert difference({**RUN, PEAK: 0.0}, PEAK) is None
    assert difference({**RUN, PEAK: None}, PEAK) is None
    exact = difference({**RUN, "error_bar_" + PEAK: 0.0}, PEAK)
    assert exact is not None
    assert exact.bars == float("inf")


def test_a_stopper_has_a_block_of_its_own() -> None:
    """Below the rows of the seat, without bars; its raw peak stands with what depends on the step."""
    stopper = {
        "filtered_peak_force_N": 20.0,
        "impulse_Ns": 2e-3,
        "first_contact_s": 1.4e-3,
        "contact_count": 1,
        "peak_force_N": 33.0,
    }
    found = {f"{spring}stopper_{key}": value for spring in ("", "spring_") for key, value in stopper.items()}
    lines = printed(**found)
    first = lines.index("at the stopper")
    assert first > next(k for k, line in enumerate(lines) if line.startswith("seat displacement"))
    assert lines[first + 1 : first + 5] == [
        "peak, 2 us mean 20 N 20 N", "impulse 2 mN s 2 mN s", "first contact 1.4 ms 1.4 ms", "contacts 1 1",
    ]  # fmt: skip
    raw = next(k for k, line in enumerate(lines) if line.startswith("raw"))
    assert raw < next(k for k, line in enumerate(lines) if line.startswith("stopper peak 33 N 33 N"))
    assert not [line for line in printed() if "stopper" in line]


def test_gas_has_a_block_of_its_last_cycle() -> None:
    lines = printed(
        gas_largest_lift_m=2.01e-3, gas_opening_deg=[36.6, 395.9], gas_closing_deg=[217.8, 595.4],
        gas_seating_velocity_m_per_s=[2.2, None], gas_seat_impacts=[1, 3], gas_stopper_impacts=[11, 10],
    )  # fmt: skip
    first = lines.index("gas, last cycle")
    assert lines[first + 1 : first + 7] == [
        "largest lift 2.01 mm", "opens 395.9 deg", "closes 595.4 deg", "seating velocity -", "seat impacts 3",
        "stopper impacts 10",
    ]  # fmt: skip
    assert not [line for line in printed() if "gas" in line]


LIP: dict[str, object] = {
    "ports": 64,
    "spring_ports": 64,
    "tilt_deg": 0.3,
    "line_force_arc_m": 4.32e-3,
    "line_force_width_s": 1e-6,
    "line_force_peak_N_per_m": 8230.0,
    "spring_line_force_peak_N_per_m": 9823.0,
    "error_bar_line_force_peak_N_per_m": 1600.0,
    "line_force_peak_at_deg": 270.0,
    "spring_line_force_peak_at_deg": 264.375,
    "line_impulse_peak_Ns_per_m": 0.0608,
    "spring_line_impulse_peak_Ns_per_m": 0.0602,
    "error_bar_line_impulse_peak_Ns_per_m": 0.0017,
    "line_impulse_peak_at_deg": 101.25,
    "spring_line_impulse_peak_at_deg": 101.25,
    "first_touch_at_deg": 270.0,
    "spring_first_touch_at_deg": 270.0,
}


def test_a_contact_along_a_lip_has_a_block_of_its_own() -> None:
    """Force and impulse per length with bars, their places, what they are averaged over; the bed of springs beside."""
    lines = printed(**LIP, accuracy_measures="line_force", error_unknown="mesh")
    first = lines.index("along the lip")
    assert first > next(k for k, line in enumerate(lines) if line.startswith("seat displacement"))
    assert lines[first + 1 : first + 8] == [
        "force per length 8.2 ± 1.6 kN/m 9.8 kN/m +19 % 1 19 %, missed",
        "where 270 deg 264.4 deg",
        "impulse per length 60.8 ± 1.7 mN s/m 60.2 mN s/m -0.99 % 0.35",
        "where 101.2 deg 101.2 deg",
        "first touch 270 deg 270 deg",
        "arcs 64 64",
        "tilt 0.3 deg",
    ]
    assert "per length: mean over 4.32 mm of the lip, the force over 1 us, too" in lines
    text = " ".join(lines)
    assert "angles: 0 deg is the x axis, along the reed to its tip; anticlockwise, seen from the reed" in text
    assert "places:" not in text
    by_length = {key: None for key in LIP if key.endswith("_at_deg")} | {"line_force_peak_at_m": 12e-3}
    strip = " ".join(printed(**{**LIP, **by_length}))
    assert "a strip from its end at the lesser x" in strip
    assert "angles:" not in strip
    assert "error bars leave out what is unknown: mesh" in lines
    assert "along the lip" not in printed(line_force_peak_N_per_m=None)  # as in every summary


def test_what_simpler_models_would_say_is_one_line() -> None:
    said: dict[str, object] = {"one_port_filtered_peak_force_N": 360.6, "one_port_impulse_Ns": 1.532e-3}
    beam: dict[str, object] = {"beam_filtered_peak_force_N": 155.3, "beam_impulse_Ns": 1.309e-3}
    assert simpler(RUN) == ""
    ending = " (peak, 2 us mean, and impulse)"
    assert simpler({**RUN, **said}) == "simpler models: one port would say 361 N and 1.53 mN s" + ending
    assert simpler({**RUN, **said, **beam}).endswith(", a beam 155 N and 1.31 mN s" + ending)


def test_a_film_stands_beside_the_contact_without_it() -> None:
    film: dict[str, object] = {
        "film_force_peak_N": 220.7,
        "stiction_force_peak_N": 3.456,
        "film_loss_J": 344.2e-6,
        "spring_film_force_peak_N": 233.3,
        "without_film_" + PEAK: 357.6,
        "without_film_" + IMPULSE: 1.532e-3,
    }
    told = printed(**film)
    assert "of the film" in told
    assert row("largest force", **film) == "largest force 220.7 N 233.3 N"
    assert row("largest pull", **film) == "largest pull 3.456 N"
    assert row("without it: peak, 2 us mean", **film).endswith("357.6 N")
    assert "of the film" not in printed()
    assert simpler({**RUN, **film}).startswith("simpler models: one without the film would say 358 N and 1.53 mN s")
    unstruck = {**RUN, **film, "first_contact_s": None}
    assert verdict(unstruck) == verdict({**RUN, **film})


LIFE: dict[str, object] = {
    "life_margin": 1.35,
    "spring_life_margin": 1.4,
    "error_bar_life_margin": 0.05,
    "life_cycles": 2.3e12,
    "life_damage_per_cycle": 1 / 2.3e12,
    "life_at": "reed, root, face away from the seat",
    "life_design_cycles": 4.5e9,
    "life_survival": 0.999,
    "life_criterion": "goodman",
    "life_strength_source": "invented",
}


def test_the_life_of_the_reed() -> None:
    """Margins in the table, and a sentence that says where, by what, and whose numbers."""
    lines = printed(**LIFE)
    assert "margin on stress 1.350 ± 0.050 1.400 +3.7 % 1" in lines
    assert "cycles to failure 2.3e+12" in lines
    assert not any(line.startswith("margin on speed") for line in lines)
    assert not any("fatigue" in line for line in printed())
    assert lasting(LIFE) == (
        "fatigue: the reed endures 4.5e+09 cycles with 99.9 % survival, also under 1.35 +- 0.05 times the stress "
        "(reed, root, face away from the seat; goodman; invented)"
    )
    short = lasting({**LIFE, "life_margin": 0.7, "life_cycles": 1.2e6})
    assert "the reed fails after 1.2e+06 of 4.5e+09 cycles with 99.9 % survival; it would endure 0.7 +- 0.05" in short
    assert "no stress, however large, uses up 4.5e+09 cycles" in lasting({**LIFE, "life_margin": None})
    speed = {"life_speed_margin": 4.0, "life_speed_m_per_s": 2.0, "life_speed_limit_m_per_s": 8.0}
    told = lasting({**speed, "life_speed_source": "a report"})
    assert told == "fatigue: it closes at 2 m/s, 0.25 of the 8 m/s allowed (a report)"
