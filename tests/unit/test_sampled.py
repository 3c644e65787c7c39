"""Sampled Green's functions: exact integrals, tails, refusals."""

import numpy as np
import pytest

from impact.greens import GreensFunctionError
from impact.sampled import SampledGreens

G = np.array([1.0, 3.0, 2.0])
H = 0.5  # S(1.0) = 0.5 (1/2 + 3 + 2/2) = 2.25


def test_linear_between_samples_and_exactly_integrated():
    g = SampledGreens(G, H)
    assert g.impulse_response(np.array([-1.0, 0.0, 0.25, 0.5, 0.8, 1.0])) == pytest.approx([0, 1, 2, 3, 2.4, 2])
    t = np.linspace(0, 1, 7)
    fine = [np.trapezoid(g.impulse_response(s := np.linspace(0, x, 60001)), s) for x in t]
    assert g.step_response(t) == pytest.approx(np.array(fine), abs=1e-8)
    assert g.step_response(1.0) == pytest.approx(2.25)
    assert g.initial_value() == pytest.approx(1.0)
    assert g.ports == ("contact",)


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
    with pytest.raises(GreensFunctionError, match=r"asked for at 1.5 s but known up to 1 s"):
        g.step_response(1.5)
    with pytest.raises(GreensFunctionError, match="known up to"):
        g.step_kernel(0.3, 4)
    with pytest.raises(GreensFunctionError, match="static compliance is unknown"):
        g.static_compliance()
    assert SampledGreens(G, H, static=np.array([[7.0]])).static_compliance()[0, 0] == 7.0


def test_step_kernel_sums_to_the_step_response():
    g = SampledGreens(G, H, "hold")
    kernel = g.step_kernel(0.3, 6)
    assert kernel.modal is None
    assert kernel.weights.shape == (1, 1, 6)
    assert kernel.weights[0, 0].cumsum() == pytest.approx(g.step_response(0.3 * np.arange(1, 7)))
    assert kernel.self_weight(0.3)[0, 0] == pytest.approx(float(g.step_response(0.3)))


def test_several_ports():
    values = np.einsum("ij,n->ijn", [[2.0, 1.0], [1.0, 3.0]], G)
    g = SampledGreens(values, H, port_names=("lip", "back"))
    assert g.impulse_response(0.5, 0, 1) == pytest.approx(3.0)
    assert g.port_index("back") == 1
    assert g.step_kernel(0.25, 4).weights.shape == (2, 2, 4)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.array([1.0, np.nan]), H), "1 of 2 samples are not finite"),
        ((np.array([-1.0, 1.0]), H), r"g\(0\+\) = -1"),
        ((np.array([1.0]), H), "n >= 2"),
        ((G, -H), "dt = -0.5 s must be positive"),
        ((G, H, "mirror"), "tail 'mirror' is unknown; choose from zero, hold, rigid, forbid"),
        ((G, H, "zero", ("a", "b")), "2 port names for 1 ports"),
        ((np.array([[G, G], [2 * G, G]]), H), "differ by 5.0e-01"),
    ],
)
def test_refusals(arguments, message):
    with pytest.raises(GreensFunctionError, match=message):
        SampledGreens(*arguments)
