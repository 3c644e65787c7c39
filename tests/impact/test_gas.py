"""Gas through a reed valve: closed forms of nozzle and cylinder, and the coupled march against another solver."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import impact
from impact import gas
from impact.greens.base import Array

AIR = gas.GASES["air"]
CRANK = gas.SliderCrank(bore=50e-3, stroke=40e-3, rod=80e-3, clearance=4e-6, rpm=3000.0)
LOW, HIGH = gas.Plenum(1e5, 293.15), gas.Plenum(5e5, 350.0)
PORT = gas.port_force(5e-3)


def table(*rows: tuple[float, float]) -> gas.AreaTable:
    lift, area = np.array(rows).T
    return gas.AreaTable(lift, area, "test")


VALVE = gas.ReedValve(
    flow=table((0, 0), (2e-3, 4e-5)),
    flow_back=table((0, 0), (2e-3, 3e-5)),
    force=table((0, 8e-5), (2e-3, 6e-5)),
    force_back=table((0, 9e-5), (2e-3, 5e-5)),
)


def compressor(side: str = "suction", **changes: object) -> gas.Compressor:
    start = {"suction": HIGH, "discharge": LOW}[side].pressure
    drive = gas.Compressor(AIR, CRANK, VALVE, LOW, HIGH, side, other_area=2e-5, start_pressure=start)  # type: ignore[arg-type]
    return replace(drive, **changes)  # type: ignore[arg-type]


def test_choked_flow() -> None:
    """The flow is p_u sqrt(k/(R T)) (2/(k + 1))^((k + 1)/(2 (k - 1))); for air that is 0.0404 p/sqrt(T) in SI."""
    k, r = AIR.k, AIR.constant
    exact = 2e5 * math.sqrt(k / (r * 300)) * (2 / (k + 1)) ** ((k + 1) / (2 * (k - 1)))
    assert AIR.critical == pytest.approx(0.528282, rel=1e-6)
    for fall in (0.472 * 2e5, 1.5e5, 2e5):
        assert AIR.flux(2e5, 300.0, fall) == pytest.approx(exact, rel=1e-12)
    assert AIR.flux(1e5, 288.15, 9e4) == pytest.approx(0.0404 * 1e5 / math.sqrt(288.15), rel=1e-3)
    assert AIR.flux(2e5, 300.0, 0.46 * 2e5) < exact * (1 - 1e-5)


def test_flow_below_the_choke() -> None:
    """The flow is density times velocity of an isentropic change; for small drops it is sqrt(2 rho dp)."""
    vapour = gas.of_molar_mass(1.108, 0.102)
    for ratio in (0.65, 0.9, 0.999):
        now = 300 * ratio ** ((vapour.k - 1) / vapour.k)
        exact = 3e5 * ratio / (vapour.constant * now) * math.sqrt(2 * vapour.heat * (300 - now))
        assert vapour.flux(3e5, 300.0, 3e5 * (1 - ratio)) == pytest.approx(exact, rel=1e-11)
    assert vapour.flux(3e5, 300.0, 1e-3) == pytest.approx(math.sqrt(2 * 3e5 / (vapour.constant * 300) * 1e-3), rel=1e-8)


def test_a_vessel_fills_from_a_plenum() -> None:
    """Pressure rises by k R T_u m'/V a second while choked, and ends at the plenum's with V dp/(k R T_u) gained."""
    state = [0.0] * gas.STATE
    state[:2] = 1e5, 1e5 * 1e-3 / (AIR.constant * 300)
    before, slope = state.copy(), 1.4 * AIR.constant * 350 * 1e-5 * AIR.flux(5e5, 350.0, 4e5) / 1e-3
    for _ in range(20):
        gas.let_in(AIR, state, 1e-3, HIGH, 1e-5, 1e-3)
    assert state[gas.PRESSURE] - 1e5 == pytest.approx(20e-3 * slope, rel=1e-4)
    for _ in range(3000):
        gas.let_in(AIR, state, 1e-3, HIGH, 1e-5, 1e-3)
    assert state[gas.PRESSURE] == 5e5
    gained = 4e5 * 1e-3 / (1.4 * AIR.constant * 350)
    assert state[gas.MASS] - before[gas.MASS] == pytest.approx(gained, rel=1e-12)
    assert state[gas.ENTHALPY] == pytest.approx(4e5 * 1e-3 / 0.4, rel=1e-12)


OMEGA, KILO = 2 * math.pi * 250, 1 / math.sqrt(2e-3)  # a reed of one mode, 2 g


def striker(drive: gas.Compressor | gas.Prescribed) -> impact.Body:
    one = np.array([OMEGA])
    greens = impact.ModalGreens(one, np.array([0.05]), np.array([[KILO]]), impact.Residual.none())
    at_start = drive.valve.push(0.0, gas.drop(drive, float(drive.start()[gas.PRESSURE])))
    load = impact.Load(np.array([KILO]), lambda t: np.full(np.shape(t), at_start), feedback=drive)
    state = impact.ModalState(np.array([3e-4 / KILO]), np.zeros(1))
    return impact.Body(greens, state=state, loads=(load,))


def marched(
    drive: gas.Compressor | gas.Prescribed, dt: float, gap: float = 5e-4, span: float = 9.6e-3
) -> tuple[impact.ImpactResult, gas.GasHistory]:
    problem = impact.ContactProblem(striker(drive), impact.Body(impact.spring(stiffness=1e6)), gap=gap)
    result = impact.solve(problem, dt=dt, duration=span)
    return result, gas.gas_history(drive, result.gap, dt)


def reference(drive: gas.Compressor, gap: float, span: float) -> Array:
    """Return lift, pressure and mass at the end by an adaptive Runge-Kutta method; the equations are written anew."""
    k, r = 1.4, AIR.constant

    def stream(area: float, p1: float, t1: float, p2: float) -> float:
        ratio = max(p2 / p1, (2 / (k + 1)) ** (k / (k - 1)))
        root = max(ratio ** (2 / k) - ratio ** ((k + 1) / k), 0.0)
        return area * p1 * math.sqrt(2 * k / ((k - 1) * r * t1) * root)

    def volume(t: float) -> float:
        turn = 2 * math.pi * 50 * t + drive.crank.start
        return 4e-6 + math.pi * 6.25e-4 * (
            0.02 - 0.02 * math.cos(turn) + 0.08 - (0.0064 - (0.02 * math.sin(turn)) ** 2) ** 0.5
        )

    def rates(t: float, y: Array) -> list[float]:
        u, v, p, m = y
        volume_now, lift = volume(t), max(gap + u, 0.0)
        slope, warm, dp = (volume(t + 1e-7) - volume(t - 1e-7)) / 2e-7, p * volume(t) / (m * r), 1e5 - p
        area = (4e-5 if dp > 0 else 3e-5) * min(lift / 2e-3, 1.0)
        push = dp * ((8e-5 - 2e-5 * min(lift / 2e-3, 1)) if dp > 0 else (9e-5 - 4e-5 * min(lift / 2e-3, 1)))
        came = stream(area, 1e5, 293.15, p) if dp > 0 else -stream(area, p, warm, 1e5)
        went = stream(2e-5, p, warm, 5e5) if p > 5e5 else 0.0
        into = (293.15 if dp > 0 else warm) * came - warm * went
        return [v, push / 2e-3 - OMEGA**2 * u - 0.1 * OMEGA * v, k / volume_now * (r * into - p * slope), came - went]

    start = drive.start()
    y = [3e-4, 0.0, start[gas.PRESSURE], start[gas.MASS]]
    path = solve_ivp(rates, (0, span), y, method="DOP853", rtol=1e-10, atol=[1e-12, 1e-9, 1e-4, 1e-14], max_step=2e-5)
    return np.array([gap + path.y[0, -1], *path.y[2:, -1]])


@pytest.mark.parametrize(
    ("degrees", "start", "span", "order"),
    [(40.0, 0.95e5, 3.2e-3, 2), (190.0, 1.5e5, 0.64e-3, 2), (40.0, 1.2e5, 9.6e-3, 0)],
)
def test_the_coupled_march_against_another_solver(degrees: float, start: float, span: float, order: int) -> None:
    """An intake, a backflow, and both with compression agree with an adaptive solver, to second order (where pressures
    cross only the size is known, as the flow is not smooth there); mass and energy balance to 1e-9, and 3 % of any
    coefficient would show."""
    crank = replace(CRANK, start=math.radians(degrees))
    drive = compressor(crank=crank, start_pressure=start)
    exact, errors = reference(drive, 5e-4, span), []
    for dt in (1e-6, 5e-7, 2.5e-7):
        result, history = marched(drive, dt, span=span)
        assert not np.any(result.force)
        end_values = np.array([result.gap[-1], *history.states[-1, [gas.PRESSURE, gas.MASS]]])
        errors.append(np.abs(end_values / exact - 1))
        volume = np.array([crank.volume(t) for t in history.time])
        assert history.mass_residual("suction") < 1e-9
        assert history.energy_residual(1.4, volume) < 1e-9
        assert result.energy.residual < 1e-9
    assert np.max(errors) < 1e-4
    if order:
        np.testing.assert_allclose(errors[1] / errors[2], 2**order, atol=0.4)
    else:
        assert np.all(history.states[-1, [gas.FORWARD, gas.BACK]] > 3e-7)


@pytest.mark.slow
def test_a_discharge_valve_lets_out_and_the_ideal_suction_valve_lets_in() -> None:
    crank = replace(CRANK, start=math.pi)
    _, history = marched(compressor("discharge", crank=crank), 5e-7, gap=0.0)
    last = history.states[-1]
    assert last[gas.FORWARD] > 0.3 * history.states[0, gas.MASS]
    assert last[gas.OTHER] == 0.0
    assert history.mass_residual("discharge") < 1e-9
    drive = compressor("discharge", other_area=3e-5)
    state = drive.start()
    for step in range(500):
        drive.advance(state, step * 2e-5, 2e-5, 0.0)
    assert state[gas.OTHER] == pytest.approx(state[gas.MASS] - drive.start()[gas.MASS], rel=1e-9)

    def rate(t: float, p: Array) -> Array:
        """Return the rate of the pressure, from below the plenum's on."""
        volume, slope = CRANK.volume(t), (CRANK.volume(t + 1e-7) - CRANK.volume(t - 1e-7)) / 2e-7
        came = 3e-5 * AIR.flux(1e5, 293.15, max(1e5 - p[0], 0.0))
        return 1.4 / volume * (AIR.constant * 293.15 * came - p * slope)

    exact = solve_ivp(rate, (0, 0.01), [1e5], rtol=1e-10, max_step=2e-5).y[0, -1]
    assert 0.4e5 < exact < 0.95e5
    assert state[gas.PRESSURE] == pytest.approx(exact, rel=1e-4)


def test_it_goes_on_where_it_stopped() -> None:
    """A march restored in the middle of a span of the gas continues with the very same gaps."""
    problem = impact.ContactProblem(striker(compressor()), impact.Body(impact.spring(stiffness=1e6)), gap=5e-4)
    prepared = impact.prepare(problem, 1e-6, 4e-3)
    whole, first, second = (impact.ContactStepper(prepared) for _ in range(3))
    whole.advance(prepared.steps)
    first.advance(1003)
    second.restore(first.checkpoint())
    second.advance(7)
    second.advance(prepared.steps)
    np.testing.assert_array_equal(second.gap, whole.gap)
    state = gas.gas_history(compressor(), whole.gap[:, 0], 1e-6).states[-1]  # what the march had, found again
    np.testing.assert_allclose(state, whole.live.fed[1:], rtol=1e-12)
    with pytest.raises(impact.ContactError, match="depends on the opening"):
        impact.solve_many(problem, gaps=np.zeros(2), dt=1e-6, duration=1e-4)


def test_flow_under_a_prescribed_pressure() -> None:
    """A constant 0.9 bar draws A_e(x) times the flux; 1.2 bar pushes back gas that is 293.15 1.2^(2/7) K warm."""
    pure = gas.PerfectGas(1.4, AIR.constant)
    for bar, column in ((0.9, gas.FORWARD), (1.2, gas.BACK)):
        drive = gas.Prescribed(lambda t, p=bar: np.full(np.shape(t), p * 1e5), pure, VALVE, LOW, HIGH, "suction")  # type: ignore[misc]
        state = drive.start()
        force = drive.advance(state, 0.0, 1e-3, 1e-3)
        source = (1e5, 293.15) if bar < 1 else (1.2e5, 293.15 * 1.2 ** (2 / 7))
        area, push = (2e-5, 7e-5) if bar < 1 else (1.5e-5, 7e-5)
        assert state[column] == pytest.approx(1e-3 * area * pure.flux(*source, abs(1e5 - bar * 1e5)), rel=1e-9)
        assert force == pytest.approx((1e5 - bar * 1e5) * push, rel=1e-9)


def test_estimated_areas() -> None:
    flow = gas.port_flow(5e-3, 0.6)
    assert flow(1e-3) == pytest.approx(0.6 * 2 * math.pi * 5e-3 * 1e-3)
    assert flow(3e-3) == pytest.approx(0.6 * math.pi * 25e-6)
    assert PORT(1e-3) == pytest.approx(math.pi * 25e-6)
    assert "not measured" in flow.source
    assert "not measured" in PORT.source
    np.testing.assert_allclose(gas.angles(np.array([0.0, 0.01]), 3000.0, math.pi), [180.0, 360.0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: table((1e-3, 0.0), (2e-3, 1e-5)), "begins at a lift of 1 mm"),
        (lambda: table((0.0, 0.0), (2e-3, 1e-5), (1e-3, 1e-5)), "1 mm follows 2 mm"),
        (lambda: table((0.0, 0.0), (2e-3, -1e-5)), "an area of -10 mm"),
        (lambda: replace(VALVE, force=table((0.0, 0.0), (1e-3, 1e-5))), "force area at lift 0 is 0"),
        (lambda: replace(CRANK, clearance=0.0), "clearance = 0 must be positive"),
        (lambda: replace(CRANK, rod=20e-3), "no longer than half the stroke"),
        (lambda: gas.Plenum(0.0, 300.0), "both must be positive"),
        (lambda: gas.PerfectGas(1.0, 287.0), "k > 1"),
        (lambda: gas.of_molar_mass(1.4, 0.0), "molar mass"),
    ],
)
def test_what_is_refused(make: object, words: str) -> None:
    with pytest.raises(gas.GasError, match=words):
        make()  # type: ignore[operator]
