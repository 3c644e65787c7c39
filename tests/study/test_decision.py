"""A run says go, no-go or undecided, and why: margins with their bars, strength, accuracy, landing."""

from __future__ import annotations

import re

import pytest

from seatfem.study.answers.decision import decide, how_often_checked

RUN: dict[str, object] = {
    "landing_status": "landed", "landing_count": 2, "landing_number": 1, "landing_closing_speed_m_per_s": 1.367,
    "error_bar_landing_closing_speed_m_per_s": 0.0044, "landing_filtered_peak_force_N": 36.64,
    "error_bar_landing_filtered_peak_force_N": 0.47, "filter_width_s": 5e-6, "peak_reed_stress_Pa": 364.3e6,
    "accuracy_target": 0.05, "accuracy_met": True, "accuracy_judged_keys": "landing_filtered_peak_force_N",
    "life_margin": 1.336, "error_bar_life_margin": 0.013, "life_strength_source": "Sandvik 7C27Mo2, data sheet 2019",
    "seat_kind": "annular", "reed_kind": "cantilever", "peak_seat_stress_Pa": 1e6,
}  # fmt: skip
"""Summary of a run with a cited strength, whose margin is clearly above 1."""
SOURCE = "life_strength_source"


def test_a_clear_margin_on_a_cited_strength_is_go_and_says_what_happens() -> None:
    decision = decide(RUN)
    assert decision.word == "go"
    happens = "1.3670 ± 0.0044 m/s with 36.64 ± 0.47 N; reed stress up to 364.3 MPa, seat stress up to 1 MPa, "
    assert decision.happens.startswith("The reed lands twice on the seat, the hardest at ")
    assert decision.happens.endswith(f"{happens}fatigue margin 1.336 ± 0.013.")
    assert "Fatigue margin 1.336 ± 0.013: above 1." in decision.reasons
    assert any(re.match(r"Accuracy of 5 % reached: peak force \(mean over 5 us\) ±1\.28 %", each)
               for each in decision.reasons)  # fmt: skip
    assert decision.left_out == ()


@pytest.mark.parametrize(
    ("changed", "word", "first"),
    [
        ({"life_margin": 0.9}, "no-go", "Fatigue margin 0.900 ± 0.013: below 1"),
        ({"life_margin": 1.01}, "undecided", "its uncertainty includes 1"),
        ({"life_margin": 0.99}, "undecided", "its uncertainty includes 1"),
        ({"error_bar_life_margin": None}, "undecided", "its uncertainty is not known"),
        ({"error_bar_life_margin": 0.7, "life_margin": 1.2}, "undecided", "its uncertainty includes 1"),
        ({"life_margin": None}, "go", "no multiple of the load"),
        ({"life_speed_margin": 0.5}, "no-go", "Margin on closing speed 0.5000 ± 0.0016: below 1"),
        ({"life_multiaxial_margin": 1.2}, "undecided", "Fatigue margin, multiaxial 1.2: its uncertainty is not known"),
        ({"life_multiaxial_margin": 1.2, "error_bar_life_multiaxial_margin": 0.3, "life_margin": 0.5},
         "no-go", "0.500"),
        ({SOURCE: "invented for this example; not a material"}, "undecided", "not a cited one .*invented"),
        ({SOURCE: "assumed: 500 MPa"}, "undecided", "not a cited one"),
        ({SOURCE: "  "}, "undecided", "not a cited one"),
        ({SOURCE: None}, "undecided", "no source"),
        ({SOURCE: "invented", "life_margin": 0.5}, "undecided", "not a cited one"),
        ({"life_margin": ...}, "undecided", "No strength is stated"),
        ({"accuracy_met": False}, "undecided", "Accuracy of 5 % missed: peak force .* ±1.28 %"),
        ({"life_margin": ..., "life_speed_margin": 1.3}, "undecided", "No strength is stated"),
        ({"stress_not_modelled": ["the reed dishes over its port"]}, "undecided", "^The reed dishes over its port"),
        ({"life_not_judged": "The stress below the contact was not judged."}, "undecided", "below the contact"),
        ({"life_basis": "for 50 % of the parts"}, "go", "0.013 for 50 % of the parts: above 1"),
        ({"landing_status": "cut off"}, "undecided", "Cut off: .* Remedy: "),
        ({"landing_status": "no landing", "landing_count": 0, "accuracy_met": None}, "undecided", "No landing: "),
    ],
)  # fmt: skip
def test_what_decides_stands_first(changed: dict[str, object], word: str, first: str) -> None:
    summary = {key: value for key, value in (RUN | changed).items() if value is not ...}
    decision = decide(summary)
    assert (decision.word, decision.keys()["decision"]) == (word, word)
    assert re.search(first, decision.reasons[0]), decision.reasons


def test_a_run_without_a_landing_does_not_speak_of_one() -> None:
    nothing = RUN | {"landing_count": 0, "landing_filtered_peak_force_N": None, "contact_count": 0}
    assert decide(nothing).happens.startswith("The reed does not land on the seat")


def test_what_was_left_out_is_a_sentence_each() -> None:
    summary = {
        **RUN, "not_modelled": ["the film is incompressible"], "error_unknown": "mesh", "plan_seat_level": "spring",
        "landings": [{}] * 5, "known_landings": 3, "peak_seat_stress_Pa": None,
    }  # fmt: skip
    waves, film, mesh, statistics, stress = decide(summary).left_out
    assert re.match(r"Waves in the seat are left out: .* seat\.model = \"3d\"", waves)
    assert film == "The film is incompressible."
    assert mesh == "Not included in the uncertainty: mesh error."
    assert statistics == "Landings 1 to 3 can be predicted, from 4 on only statistics."
    assert stress.startswith("Stress in the seat was not computed")


def test_how_often_such_a_scene_was_checked_is_said_in_words() -> None:
    often = how_often_checked(RUN)
    assert re.fullmatch(
        r'\d+ test scenes with a seat "annular" and a reed "cantilever" .*: \d+ of \d+ .* within their uncertainty\.',
        often,
    )
    never = how_often_checked({"seat_kind": "annular", "reed_kind": "unheard of"})
    assert re.fullmatch(r"No test scene .*; \d+ had such a seat, 0 such a reed: treat .* with caution\.", never)
