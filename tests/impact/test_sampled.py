"""Sampled Green's functions: exact integrals, tails, refusals."""

import numpy as np
import pytest

from impact.greens.base import GreensFunctionError
from impact.greens.sampled import SampledGreens
from impact.measured.frf import read_impulse_response

G = np.array([1.0, 3.0, 2.0])
H = 0.5  # S(1.0) = 0.5 (1/2 + 3 + 2/2) = 2.25


@pytest.mark.parametrize(
    ("tail", "value", "step", "static"),
    [("zero", 0.0, 2.25, 2.25), ("hold", 2.0, 2.25 + 2.0, np.inf), ("rigid", 0.0, 2.25 + 1.0, -np.inf)],
)
def test_tails(tail, value, step, static):
    g = SampledGreens(G, H, tail)  # rigid: the slope -2 goes on, from 2 at t = 1 to 0 at t = 2
    assert g.impulse_response(2.0) == pytest.approx(value, abs=1e-12)
    assert g.step_response(2.0) == pytest.approx(step)
    assert g.static_compliance()[0, 0] == static


def test_forbid_says_how_far_it_is_known():
    g = SampledGreens(G, H)
    with pytest.raises(GreensFunctionError, match=r"asked.*1.5 s.*1 s"):
        g.step_response(1.5)
    assert SampledGreens(G, H, static=np.array([[7.0]])).static_compliance()[0, 0] == 7.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.array([1.0, np.nan]), H), "1 of 2 samples are not finite"),
        ((np.array([-1.0, 1.0]), H), r"g\(0\+\) = -1"),
        ((np.array([1.0]), H), "n >= 2"),
        ((G, -H), "dt = -0.5 s must be positive"),
        ((G, H, "mirror"), "'mirror'.*unknown"),
        ((G, H, "zero", ("a", "b")), "2 port names for 1 ports"),
        ((np.array([[G, G], [2 * G, G]]), H), "differ by 5.0e-01"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(GreensFunctionError, match=message):
        SampledGreens(*arguments)


TIME = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
VALUE = np.array([0.0, 0.0, 1.0, 3.0, 2.0])


def test_from_series():
    g = SampledGreens.from_series(TIME, VALUE, tail="hold", port_names=("lip",))
    assert g.values[0, 0] == pytest.approx(G)  # zeros before t = 0 are causal
    assert (g.dt, g.tail, g.ports) == (0.5, "hold", ("lip",))
    assert "pretrigger" not in g.provenance
    rounded = TIME + 0.002 * np.array([1, -1, 0, 1, 0.0])  # within 1 % of the spacing
    assert SampledGreens.from_series(rounded, VALUE).values[0, 0] == pytest.approx(G)
    both = np.einsum("ij,n->ijn", [[2.0, 1.0], [1.0, 3.0]], VALUE)
    times = np.broadcast_to(TIME, both.shape)
    assert SampledGreens.from_series(times, both).impulse_response(0.5, 0, 1) == pytest.approx(3.0)


def test_motion_before_the_blow():
    early = VALUE.copy()
    early[1] = 0.5
    with pytest.raises(GreensFunctionError, match=r"2 samples.*t = 0.*0\.5 .* 1\.8 % .*drop"):
        SampledGreens.from_series(TIME, early)
    g = SampledGreens.from_series(TIME, early, pretrigger="drop", origin={"kind": "measured"})
    assert g.values[0, 0] == pytest.approx(G)
    assert g.provenance["kind"] == "measured"
    assert g.provenance["pretrigger"] == {"samples": 2, "share_of_squares": pytest.approx(0.25 / 14.25)}


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (TIME + np.array([0, 0, 0, 0.1, 0]), VALUE, r"sample 2.*0 s.*0\.6 s.*0\.5 s"),
        (-TIME, VALUE, "not equally spaced"),
        (TIME + 1.5, VALUE, r"starts at 0\.5 s"),
        (TIME + 0.1, VALUE, r"t = 0.*nearest.*0\.1 s"),
        (TIME - 1.0, VALUE, "no sample at t = 0"),
        (TIME[:3], VALUE, r"\(3,\).*\(5,\)"),
        (np.stack([[TIME, TIME], [TIME, 1.1 * TIME]]), np.ones((2, 2, 5)), r"sample 0.*-1\.1 s.*2, 2.*-1 s"),
    ],
)
def test_refused_times(time, values, message):
    with pytest.raises(GreensFunctionError, match=message):
        SampledGreens.from_series(time, values)


def write(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def test_read_impulse_response(tmp_path):
    file = write(tmp_path / "g.csv", "# hammer\ntime [us],impulse_response [um/(N s)]\n0,1\n500000,3\n1000000,2\n")
    g = read_impulse_response(file, tail="hold", port_name="lip")
    assert g.values[0, 0] == pytest.approx(1e-6 * G)
    assert g.dt == pytest.approx(0.5)
    assert (g.ports, g.tail) == (("lip",), "hold")
    assert g.provenance == {"kind": "measured", "file": "g.csv"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [us],force [N]\n0,1\n", r"line 1, column 2:.*'force \[N\]'.*'impulse_response \[unit\]'"),
        ("time [us],impulse_response [um]\n0,1\n", r"m/\(N s\), mm/\(N s\)"),
        ("time [us],impulse_response [um/(N s)]\n", "do not match"),
        ("time [us],impulse_response [um/(N s)]\n0,-1\n1,1\n", r"g\(0\+\) = -1e-06"),
    ],
)
def test_refused_files(tmp_path, text, message):
    with pytest.raises(ValueError, match=message) as refusal:
        read_impulse_response(write(tmp_path / "g.csv", text))
    assert "g.csv" in str(refusal.value)
    with pytest.raises(GreensFunctionError, match="no such file"):
        read_impulse_response(tmp_path / "missing.csv")
