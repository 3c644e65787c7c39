"""What people look at: numbers, texts of a few lines and never arrays, tables in HTML, data frames, figures."""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import impact
import seatfem
from impact.greens.base import ErrorEstimate
from impact.quantities import as_html, in_digits, in_units, percent
from seatfem.study.runs.outcome import RunOutcome
from tests.rod_model import rod_model

LARGEST, LINES = 1500, 14
BALL = impact.rigid_mass(mass=1e-3, velocity=-1.0)
HIT = impact.ContactProblem(BALL, impact.spring(stiffness=1e6))


@pytest.fixture(scope="module")
def result() -> impact.ImpactResult:
    return impact.solve(HIT, dt=1e-7, duration=1.2e-4)


def examples(run: impact.ImpactResult) -> dict[str, object]:
    many = 5000
    greens = impact.ModalGreens(
        np.linspace(1e3, 1e6, many), np.full(many, 0.01), np.ones((many, 2)), impact.Residual.spring(np.eye(2)),
        ("left", "right"), ErrorEstimate(0.01), {"method": "krylov", "list": list(range(many)), "text": "x" * many},
    )  # fmt: skip
    reed = impact.cantilever_reed(
        young=2e11, density=7850.0, length=25e-3, width=1e-2, thickness=3e-4, n_modes=200, tip_deflection=1e-3
    )
    contacts = [impact.Contact(greens, port=p, law=impact.LinearSpring(1e6)) for p in ("left", "right")] * 30
    problem = impact.ContactProblem(BALL, contacts=contacts[:2])
    prepared = impact.prepare(problem, 1e-7, 1e-4)
    stepper = impact.ContactStepper(prepared)
    model = rod_model(young=2e11, density=7850.0, area=1e-4, length=0.03, elements=100)
    return {
        "modal": greens, "poles": impact.PoleGreens.from_modal(greens),
        "samples": impact.SampledGreens(np.zeros(many), 1e-6, "zero"), "sum": impact.SumGreens((greens,) * 20),
        "multiple": impact.ScaledGreens(impact.ScaledGreens(greens, 2.0), 2.0),
        "half-space": impact.half_space_patch(young=2e11, poisson=0.3, density=7850.0, radius=1e-3),
        "residual": greens.residual, "kernel": greens.step_kernel(1e-6, 10), "ball": BALL, "reed": reed,
        "state": reed.state, "load": impact.Load(np.ones(many), np.zeros_like), "contact": contacts[0],
        "problem": problem, "problem of many": impact.ContactProblem(BALL, contacts=contacts), "result": run,
        "energy": run.energy, "prepared": prepared, "stepper": stepper, "step": stepper.step(),
        "batch": impact.solve_many(HIT, dt=1e-6, duration=1e-4, velocities=np.linspace(-2, -1, 40), record="force"),
        "series": impact.TimeSeries(np.arange(many, dtype=float), np.zeros(many)),
        "passivity": impact.passivity(impact.spring(stiffness=1.0), 1e-6, 100), "model": model,
        "port": model.ports["contact"], "modes": seatfem.solve_modes(model, 20),
        "reduction": seatfem.reduce_model(model, bandwidth=1e5, duration=1e-5, tolerance=0.05),
        "store": seatfem.Store(Path("folder")),
    }  # fmt: skip


@pytest.mark.slow
def test_it_prints_in_a_few_lines(result: impact.ImpactResult) -> None:
    for name, thing in examples(result).items():
        for text in (str(thing), repr(thing)):
            assert len(text) <= LARGEST, name
            assert len(text.splitlines()) <= LINES, name
            assert "array([" not in text, name
            assert max(map(len, text.splitlines())) <= 700, name


def test_a_result_says_in_four_lines_what_happened() -> None:
    """Four lines give peak, impulse, contacts and the balance of energy, or that nothing touches."""
    hit = impact.ContactProblem(BALL, impact.spring(stiffness=1e7))
    lines = repr(impact.solve(hit, dt=1e-7, duration=1e-4)).splitlines()
    assert re.search(r"99\.\d+ N at 15\.7 us, .*1\.99\d? mN s", lines[1])
    assert re.search(r"once, .*0 s to 31\.[45] us", lines[2])
    assert len(lines) == 4
    away = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=1.0), impact.spring(stiffness=1e7))
    assert "no contact" in repr(impact.solve(away, dt=1e-7, duration=1e-5))


def test_html_is_the_text_as_a_table_and_nothing_in_it_is_markup(result: impact.ImpactResult) -> None:
    greens = impact.spring(stiffness=1e6)
    for thing in (result, greens, impact.Body(greens), impact.ContactProblem(greens, greens)):
        table = ElementTree.fromstring(thing._repr_html_())
        assert len(table) == len(str(thing).splitlines())
        shown = "".join(table.itertext())
        assert re.sub(r"[:\s]", "", shown) == re.sub(r"[:\s]", "", str(thing))
    assert "<script>" not in as_html("<script>\n<b>: <i>")
    assert as_html("a\nb: c: d").count("</t") == as_html("a\nb: c: d").count("<t")


@pytest.mark.slow
def test_a_run_as_a_data_frame(result: impact.ImpactResult) -> None:
    frame = result.to_dataframe()
    assert frame.index.name == "time_s"
    assert np.array_equal(frame["force_N"], result.force)
    assert frame["energy_input_J"].iloc[0] == pytest.approx(0.5e-3)
    two = [impact.Contact(impact.spring(stiffness=1e6), gap=g) for g in (0.0, 1e-6)]
    several = impact.solve(impact.ContactProblem(BALL, contacts=two), dt=1e-7, duration=1e-5)
    assert np.array_equal(several.to_dataframe()["gap_m[1]"], several.gap[:, 1])


@pytest.mark.slow
def test_measures_as_text_and_as_a_data_frame() -> None:
    summary = {
        "impulse_Ns": 2e-3, "error_bar_impulse_Ns": 1e-5, "spring_impulse_Ns": 1.9e-3, "contact_count": 3,
        "error_in_words": "none", "plan_cost_s": 2.0, "preloaded": True, "first_contact_s": None,
    }  # fmt: skip
    outcome = RunOutcome(summary, ("a note",), (), met=False)
    assert str(outcome).splitlines() == [
        "RunOutcome, target missed, 0 files",
        "  impulse_Ns: 2.000 ± 0.010 mN s, spring baseline 1.9 mN s",
        "  note: a note",
    ]
    frame = outcome.to_dataframe()
    assert list(frame.index) == ["impulse_Ns", "contact_count"]
    assert frame.loc["impulse_Ns", "spring"] == 1.9e-3
    assert frame.loc["impulse_Ns", "unit"] == "N s"


def test_modes_as_a_data_frame() -> None:
    modes = seatfem.solve_modes(rod_model(young=2e11, density=7850.0, area=1e-4, length=0.03, elements=20), 3)
    assert np.array_equal(modes.to_dataframe()["frequency_hz"], modes.frequencies_hz)


@pytest.mark.slow
def test_plots_return_figures_to_be_shown(result: impact.ImpactResult) -> None:
    rod = impact.fixed_rod(young=2e11, density=7850.0, area=1e-6, length=0.01)
    figures = [plot(result) for plot in (impact.plot_force, impact.plot_motion, impact.plot_energy)]
    figures.append(impact.plot_greens(rod, duration=1e-4, width=2e-6))
    assert [figure.get_suptitle() for figure in figures] == [
        "Contact force", "Motion of the contact points", "Energy", "Driving-point Green's function"
    ]  # fmt: skip
    assert all(len(figure.axes) >= 2 for figure in figures)


@pytest.mark.parametrize(
    ("value", "digits", "words"),
    [
        (1.2000000000000002, 3, "1.2"),
        (1.312e14, 2, "1.3e14"),
        (1e10, 2, "1e10"),
        (-0.0, 3, "0"),
        (-1e-9, 2, "-1e-9"),
        (999.96, 3, "1000"),
        (0.00012, 2, "0.00012"),
        (123456.0, 3, "123000"),
        (float("inf"), 3, "inf"),
    ],
)
def test_a_number_has_no_needless_digit(value: float, digits: int, words: str) -> None:
    assert in_digits(value, digits) == words


@pytest.mark.parametrize(
    ("share", "words"),
    [(-0.0, "0 %"), (1.0, "+100 %"), (-0.19, "-19 %"), (12.34, "+1200 %"), (7e-5, "+0.007 %"), (1.8e-15, "0 %")],
)
def test_a_share_in_per_cent(share: float, words: str) -> None:
    """A zero has no sign, a hundred no power of ten."""
    assert percent(share, sign=True) == words


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        (2e-7, "s", "200 ns"),
        (3.05e-4, "m", "305 um"),
        (1183.0, "N", "1.18 kN"),
        (2e-5, "m^2", "20 mm^2"),
        (0.5, "", "0.5"),
    ],
)
def test_a_quantity_has_a_unit_of_its_size(value: float, unit: str, words: str) -> None:
    assert in_units(value, unit) == words
