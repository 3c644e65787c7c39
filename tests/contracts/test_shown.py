"""What people look at in notebooks: tables in HTML, data frames, figures."""

from __future__ import annotations

import re
import sys
from xml.etree import ElementTree

import numpy as np
import pytest

import impact
from impact.names import FrameError, frame_of
from impact.quantities import as_html
from seatfem.study.runs.kept import RunOutcome
from tests.rod_model import rod_model


@pytest.fixture(scope="module")
def result() -> impact.ImpactResult:
    ball = impact.rigid_mass(mass=1e-3, velocity=-1.0)
    return impact.solve(impact.ContactProblem(ball, impact.spring(stiffness=1e6)), dt=1e-7, duration=1.2e-4)


@pytest.fixture(scope="module")
def outcome() -> RunOutcome:
    summary = {
        "impulse_Ns": 2e-3, "error_bar_impulse_Ns": 1e-5, "spring_impulse_Ns": 1.9e-3, "contact_count": 3,
        "error_in_words": "none", "plan_cost_s": 2.0, "preloaded": True, "first_contact_s": None,
    }  # fmt: skip
    return RunOutcome(summary, ("a note",), (), met=False)


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
    several = impact.solve(
        impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), contacts=two), dt=1e-7, duration=1e-5
    )
    assert np.array_equal(several.to_dataframe()["gap_m[1]"], several.gap[:, 1])


@pytest.mark.slow
def test_measures_as_text_and_as_a_data_frame(outcome: RunOutcome) -> None:
    assert str(outcome).splitlines() == [
        "RunOutcome, target missed, 0 files", "  impulse_Ns: 0.002 +- 1e-05, spring baseline 0.0019"
    ]  # fmt: skip
    frame = outcome.to_dataframe()
    assert list(frame.index) == ["impulse_Ns", "contact_count"]
    assert frame.loc["impulse_Ns", "spring"] == 1.9e-3


def test_modes_as_a_data_frame() -> None:
    import seatfem

    modes = seatfem.solve_modes(rod_model(young=2e11, density=7850.0, area=1e-4, length=0.03, elements=20), 3)
    assert np.array_equal(modes.to_dataframe()["frequency_hz"], modes.frequencies_hz)


def test_without_pandas_the_remedy_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(FrameError, match=r"seatfem\[tables\]"):
        frame_of({})


@pytest.mark.slow
def test_plots_return_figures_to_be_shown(result: impact.ImpactResult) -> None:
    rod = impact.fixed_rod(young=2e11, density=7850.0, area=1e-6, length=0.01)
    figures = [plot(result) for plot in (impact.plot_force, impact.plot_motion, impact.plot_energy)]
    figures.append(impact.plot_greens(rod, duration=1e-4, width=2e-6))
    assert [figure.get_suptitle() for figure in figures] == [
        "Contact force", "Motion of the contact points", "Energy", "Driving-point Green's function"
    ]  # fmt: skip
    assert all(len(figure.axes) >= 2 for figure in figures)
