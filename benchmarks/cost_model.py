"""Measure the constants of `impact.march.engines.CostModel` and print the line to put there."""

from __future__ import annotations

import math

import numpy as np
from scenes import DT, modal_seat, throw, throw_on_ports, throw_on_rod
from table import Table, best, publish

from impact.march.engines import MEASURED
from impact.march.history import BLOCK, BlockedSum, Poles
from impact.march.prepared import Prepared, prepare
from impact.march.stepper import ContactStepper


def march(prepared: Prepared, repeats: int = 7) -> float:
    """Shortest time of the whole march [s]."""
    ContactStepper(prepared).advance(10)
    return best(lambda: ContactStepper(prepared).advance(prepared.steps), repeats)


def pole_costs() -> tuple[float, float]:
    """Per pole and step: with one contact, and more for each further one. Differences take the laws' time out."""
    n = 20_000

    def slope(contacts: int) -> float:
        few, many = (
            march(prepare(throw_on_ports(k, contacts) if contacts > 1 else throw(k), DT, n * DT)) for k in (100, 500)
        )
        return (many - few) / 400 / n

    one, two, four = slope(1), slope(2), slope(4)
    return one, ((two - one) + (four - one) / 3) / 2


def weight_cost(poles: int = 4000, n: int = 1_000_000) -> float:
    """Per pole and step."""
    greens = modal_seat(poles)
    seen, own = Poles.from_modes([(greens, np.ones((1, 1)))], DT, 1), greens.step_matrix(DT)
    return best(lambda: seen.weights(own, n), 2) / n / poles


def multiply_cost(n: int = 20_000) -> float:
    """Per multiply-add of the direct sum."""
    return march(prepare(throw_on_rod(), DT, n * DT, engine="direct"), 5) / (n**2 / 2)


def fft_costs(n: int = 1 << 19) -> tuple[float, float, float]:
    """Transform, product and call, each on its own."""
    rng = np.random.default_rng(0)

    def folding(n: int, block: int) -> float:
        weights, force, rest = rng.normal(size=(1, 1, n)), np.ones((1, n)), np.zeros(1)

        def run() -> None:
            blocked = BlockedSum(weights, block)
            for done in range(1, n // block):
                blocked.fold(force, rest, done)

        return best(run, 5)

    call = folding(4096, 4) / (4096 / 4)
    spectra, past = rng.normal(size=(4, 4, 1 << 14)) + 0j, rng.normal(size=(4, 1 << 14)) + 0j
    product = best(lambda: np.einsum("cdf,df->cf", spectra, past), 20) / 16 / (1 << 14)
    levels = [BLOCK << i for i in range(int(math.log2(n / BLOCK)))]
    rest_of_it = folding(n, BLOCK) - n / BLOCK * call - n / 2 * len(levels) * product
    return rest_of_it / (n / 2) / sum(math.log2(2 * size) for size in levels), product, call


def main() -> None:
    """Beside the constants in use."""
    pole, pole_contact = pole_costs()
    transform, product, call = fft_costs()
    found = {
        "pole": pole,
        "pole_contact": pole_contact,
        "weight": weight_cost(),
        "multiply": multiply_cost(),
        "transform": transform,
        "product": product,
        "call": call,
    }
    rows = [(name, f"{1e9 * value:.3g}", f"{1e9 * getattr(MEASURED, name):.3g}") for name, value in found.items()]
    publish(
        "cost_model",
        Table(
            "Cost model",
            ("Constants of `impact.march.engines.CostModel` [ns]; the program chooses by those in use.",),
            ("constant", "measured in this run", "in use"),
            tuple(rows),
        ),
    )
    print(  # noqa: T201
        "CostModel(" + ", ".join(f"{name}={value:.2g}" for name, value in found.items()) + ")"
    )


if __name__ == "__main__":
    main()
