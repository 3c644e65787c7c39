"""A squeeze film in the gap, against its first integral; its march, its energy, and where it ends up."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.modal import ModalGreens, Residual
from impact.march.ladder import LadderMarch, finish_march, march, prepare_levels
from impact.march.laws import FAR
from impact.march.prepared import discretise
from impact.storage.hdf5 import restore_checkpoint, save_checkpoint

MASS, FLOOR, GAP = 1e-3, 1e-6, 5e-6
STRIP = {"viscosity": 18e-6, "length": 2 * np.pi * 5.5e-3, "width": 1e-3, "floor": FLOOR}
FILM = impact.SqueezeFilm(18e-6 * 2 * np.pi * 5.5e-3 * 1e-9, FLOOR)  # never breaks
RIGID = impact.spring(stiffness=1e18)
LAWS = [impact.Signorini(), impact.LinearSpring(1e9), impact.Hertz(1e12), impact.HuntCrossley(1e12, 0.1)]


def names(ports: int) -> tuple[str, ...]:
    return tuple(f"port {k + 1}" for k in range(ports))


def seat(ports: int) -> impact.Body:
    """Return modes from 20 kHz to 2 MHz that add up to some 20 N/um, different from port to port."""
    omega = 2 * np.pi * np.linspace(20e3, 2e6, 40)
    shapes = np.abs(np.random.default_rng(0).normal(1, 0.3, (40, ports)))
    shapes *= np.sqrt(1 / (2e7 * np.sum(1 / omega**2)))
    rest = Residual.relaxing(np.eye(ports) * 2e-9, 2 * np.pi * 3e6)
    return impact.Body(ModalGreens(omega, np.full(40, 0.02), shapes, rest, names(ports)))


def landing(
    film: impact.SqueezeFilm | None, velocity: float, dt: float, law: impact.Law = LAWS[0], **more: object
) -> impact.ImpactResult:
    """Run a mass on a seat that yields at once."""
    striker = impact.rigid_mass(mass=MASS, velocity=-velocity)
    problem = impact.ContactProblem(striker, more.pop("target", RIGID), gap=GAP, law=law, film=film)  # type: ignore[arg-type]
    return impact.solve(problem, dt=dt, duration=more.pop("duration", 200e-6))  # type: ignore[arg-type]


def several(ports: int, film: impact.SqueezeFilm | None, law: impact.Law, dt: float = 50e-9) -> impact.ImpactResult:
    body, striker = seat(ports), impact.rigid_mass(mass=MASS, velocity=-1.0)
    contacts = [impact.Contact(body, port=k, gap=GAP, law=law, film=film) for k in range(ports)]
    return impact.solve(impact.ContactProblem(striker, contacts=contacts), dt=dt, duration=60e-6)


@pytest.mark.parametrize("dt", [200e-9, 50e-9, 10e-9])
def test_a_mass_loses_to_the_film_what_its_gap_says(dt: float) -> None:
    """m v + k/2 (1/(g + f)^2 - 1/(g0 + f)^2) = m v0 at every step, however long: v over the step is the mean of its
    ends, between which the force is constant. A coefficient 3 % off moves it by 3 %, 1e9 of the tolerance."""
    result = landing(FILM, 0.2, dt)
    opened, mean = result.gap + FLOOR, np.diff(result.gap) / dt
    taken = 0.5 * FILM.coefficient * (1 / opened**2 - 1 / opened[0] ** 2)
    velocity = -0.2 + taken / MASS
    mean_speed = 0.5 * (velocity[1:] + velocity[:-1])
    assert np.all(result.solid == 0)
    np.testing.assert_allclose(mean, mean_speed, atol=1e-9 * 0.2, rtol=0)
    assert opened.min() == pytest.approx((2 * 0.2 * MASS / FILM.coefficient + 1 / (GAP + FLOOR) ** 2) ** -0.5, rel=1e-6)


def test_a_step_any_shorter_changes_less_and_never_blows_up() -> None:
    """A step of any length is stable, where c(floor) = 622 N s/m against h/W0 = 1e4 to 2e5 N s/m: a march with the c of
    the step before fails."""
    runs = [landing(FILM, 1.0, dt, target=seat(1)) for dt in (200e-9, 100e-9, 50e-9, 25e-9, 1e-9)]
    impulse, peak = np.array([(impact.measures.impulse(run), impact.measures.film_force_peak(run)) for run in runs]).T
    off = np.abs(impulse[:-1] - impulse[-1])
    assert np.all(np.log2(off[:-1] / off[1:]) > 1.5)
    assert off[0] < 1e-3 * impulse[-1]
    np.testing.assert_allclose(peak, peak[-1], rtol=0.02)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("ports", [1, 5])
@pytest.mark.parametrize("tension", [np.inf, 0.5, 0.0])
def test_no_energy_is_gained_and_all_of_it_is_accounted_for(law: impact.Law, ports: int, tension: float) -> None:
    film = replace(FILM, coefficient=FILM.coefficient / ports, tension=tension / ports)
    result = several(ports, film, law)
    lost = result.energy.film_loss
    assert not any("not found" in each.name for each in result.advice)
    assert result.energy.residual < 1e-12
    assert np.all(np.diff(lost) >= -1e-17)  # round-off of 100 N times a gap, in 0.5 mJ
    assert np.all(np.diff(result.energy.contact_loss) >= -1e-17)
    assert 0.1 < lost[-1] / result.energy.input[0] < 0.6
    assert result.solid.max() > 1.0
    assert result.solid.min() >= 0
    assert result.film.min() >= -tension / ports
    assert result.film.max() > 10.0 / ports
    if np.isfinite(tension):
        assert result.film.min() == -tension / ports or tension == 0.0


def test_solid_contact_and_film_exclude_each_other_in_the_gap() -> None:
    """While a rigid contact stays closed, its film rests; the solid force begins where the gap has ended."""
    result = several(1, FILM, impact.Signorini())
    closed = (result.gap[1:] < 1e-15) & (result.gap[:-1] < 1e-15)
    assert np.any(closed)
    np.testing.assert_allclose(result.film[1:][closed], 0.0, atol=1e-9 * result.film.max())
    assert np.all(result.solid[1:][result.gap[1:] > 1e-12] == 0)


@pytest.mark.parametrize("law", LAWS)
def test_several_ports_that_share_a_film_are_one(law: impact.Law) -> None:
    """Five ports with a fifth of spring, film and law each have the forces of one under a rigid face."""
    fifth = {impact.LinearSpring: impact.LinearSpring(2e8), impact.Hertz: impact.Hertz(2e11)}.get(
        type(law), impact.HuntCrossley(2e11, 0.1) if law is LAWS[3] else law
    )
    striker = impact.rigid_mass(mass=MASS, velocity=-1.0)
    omega, shape = np.array([2 * np.pi * 60e3]), np.array([[8.0]])
    forces = []
    for ports, each in ((1, law), (5, fifth)):
        # each port moves alone on its own spring, and with all others in one mode
        rest = Residual.spring(np.eye(ports) * ports / 5e8)
        body = impact.Body(ModalGreens(omega, np.zeros(1), np.tile(shape, ports), rest, names(ports)))
        film = FILM.part(1 / ports)
        contacts = [impact.Contact(body, port=k, gap=GAP, law=each, film=film) for k in range(ports)]
        result = impact.solve(impact.ContactProblem(striker, contacts=contacts), dt=50e-9, duration=100e-6)
        forces.append([each.reshape(len(result.time), -1).sum(axis=1) for each in (result.force, result.film)])
    size = forces[0][0].max()
    np.testing.assert_allclose(forces[1][0], forces[0][0], atol=1e-8 * size)
    np.testing.assert_allclose(forces[1][1], forces[0][1], atol=1e-8 * size)


def test_the_strip_is_that_of_stefan_and_reynolds() -> None:
    """mu l w^3 gives 622 N s/m at a micron, by Reynolds' pressure too; 1 bar on 34.6 mm^2 is the tension."""
    film = impact.SqueezeFilm.strip(**STRIP)
    assert film.coefficient / FLOOR**3 == pytest.approx(622.0, rel=1e-3)
    assert film.tension == pytest.approx(3.456, rel=1e-3)
    # the pressure mu 6 v (w^2/4 - x^2)/g^3 of a closing strip, integrated over its width by hand
    x = (np.arange(2000) + 0.5) / 2000 * 1e-3 - 0.5e-3
    pressed = np.sum(6 * 18e-6 * (0.25e-6 - x**2)) * 0.5e-6 * STRIP["length"]
    assert film.coefficient == pytest.approx(pressed, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"coefficient": 0.0}, "coefficient = 0 N s m"),
        ({"floor": -1e-6}, "floor = -1e-06 m"),
        ({"tension": -1.0}, "tension = -1 N"),
        ({"tension": np.nan}, "tension = nan N"),
    ],
)
def test_bad_films_are_refused(keys: dict[str, float], words: str) -> None:
    with pytest.raises(impact.LawError, match=words.replace("^", r"\^")):
        impact.SqueezeFilm(**{"coefficient": 1e-15, "floor": 1e-6, **keys})


def test_flight_beyond_the_film_is_taken_in_long_steps() -> None:
    """Long steps far from the seat leave the film's forces and the impulse as they are."""
    thin = impact.SqueezeFilm(1e-22, 1e-9)
    striker = impact.cantilever_reed(
        young=206e9, density=7800, length=25e-3, width=1e-2, thickness=3e-4, tip_deflection=20 * FAR * 1e-9, n_modes=5
    )  # fmt: skip
    problem = impact.ContactProblem(striker, seat(1), film=thin)
    one = discretise(problem, 100e-9, 1.6e-3)
    run, equal = finish_march(LadderMarch(one, prepare_levels(one))), march(problem, 100e-9, 1.6e-3, equal_steps=True)
    for each in (run, equal):
        assert each.rows.film[each.rows.ends < 2000].max() == 0
        assert each.rows.film.max() > 1e-3 * each.force.max()
    assert not run.rows.is_uniform
    impulses = [float(each.rows.force[1:, 0] @ each.rows.spans) for each in (run, equal)]
    assert impulses[0] == pytest.approx(impulses[1], rel=1e-4)


def test_a_march_goes_on_with_its_film_and_with_no_other(tmp_path: Path) -> None:
    problem = impact.ContactProblem(impact.rigid_mass(mass=MASS, velocity=-1.0), seat(1), gap=GAP, film=FILM)
    whole = impact.ContactStepper(impact.prepare(problem, 50e-9, 20e-6))
    whole.advance(200)
    save_checkpoint(whole, tmp_path / "half.h5")
    whole.advance(200)
    again = impact.ContactStepper(impact.prepare(problem, 50e-9, 20e-6))
    restore_checkpoint(again, tmp_path / "half.h5")
    again.advance(200)
    np.testing.assert_array_equal(again.film, whole.film)
    np.testing.assert_array_equal(again.force, whole.force)
    for other in (None, replace(FILM, floor=1.03e-6)):
        theirs = impact.ContactProblem(problem.striker, problem.target, gap=GAP, film=other)
        with pytest.raises(impact.StorageError, match="laws"):
            restore_checkpoint(impact.ContactStepper(impact.prepare(theirs, 50e-9, 20e-6)), tmp_path / "half.h5")


def test_scenes_side_by_side_have_no_film() -> None:
    problem = impact.ContactProblem(impact.rigid_mass(mass=MASS, velocity=-1.0), seat(1), gap=GAP, film=FILM)
    with pytest.raises(impact.ContactError, match=r"marched.*impact\.solve"):
        impact.solve_many(problem, dt=50e-9, duration=1e-6, gaps=[1e-6])


@pytest.mark.parametrize("seed", range(12))
def test_whatever_law_film_and_step_no_energy_is_gained(seed: int) -> None:
    """No energy is gained with films and laws of any strength, some contacts without a film."""
    draw = np.random.default_rng(seed)
    ports, law = int(draw.choice([1, 2, 5])), LAWS[seed % 4]
    body, striker = seat(ports), impact.rigid_mass(mass=MASS, velocity=-(10 ** draw.uniform(-1.5, 0.5)))
    film = impact.SqueezeFilm(
        10 ** draw.uniform(-19, -12) / ports, 10 ** draw.uniform(-7, -5), draw.choice([0.0, 1.0, np.inf])
    )
    films = [film if k == 0 or draw.random() < 0.7 else None for k in range(ports)]
    contacts = [
        impact.Contact(body, port=k, gap=1e-6 * draw.random(), law=law, film=each) for k, each in enumerate(films)
    ]
    problem = impact.ContactProblem(striker, contacts=contacts)
    result = impact.solve(
        problem, dt=10 ** draw.uniform(-8.5, -6.5), duration=40e-6, rule=("auto", "passive")[seed // 4 % 2]
    )
    lost, size = result.energy.film_loss, result.energy.input[0]
    assert lost is not None
    assert result.energy.residual < 1e-11
    assert np.diff(lost).min() > -1e-12 * size
    assert np.diff(result.energy.contact_loss).min() > -1e-12 * size
    assert result.solid.min() >= -1e-12 * np.abs(result.force).max()


def test_a_law_that_lets_go_before_the_gap_opens() -> None:
    """Hunt-Crossley, strongly damped, has no force on bodies that part fast, though they penetrate: neither has the
    film, whose gap has not opened."""
    film = impact.SqueezeFilm(5e-17, 0.88e-6, 0.0)
    striker = impact.rigid_mass(mass=MASS, velocity=-0.7)
    problem = impact.ContactProblem(striker, seat(1), gap=0.2e-6, law=impact.HuntCrossley(4.85e7, 7.8), film=film)
    result = impact.solve(problem, dt=72e-9, duration=200e-6, rule="passive")
    inside = (result.gap[1:] < 0) & (result.gap[:-1] < 0)
    assert np.any(inside & (result.force[1:] == 0))
    assert np.all(result.film[1:][inside] == 0)
    assert result.energy.residual < 1e-11
