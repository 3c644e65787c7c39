"""Which engine remembers the past: pole recursion, blocked FFT or direct sum, by a measured cost model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, get_args

from impact.greens.base import StepKernel
from impact.march.history import BLOCK
from impact.march.problem import ContactError

Engine = Literal["auto", "poles", "fft", "direct"]
MARGIN = 0.8  # poles are left for step weights only where these are predicted to take less than this part of the time


@dataclass(frozen=True)
class CostModel:
    """Costs on one core [s], p contacts, K poles, n steps.

    poles: n K (pole + (p - 1) pole_contact);  weights from poles: n K p(p+1)/2 weight;
    direct sum: p^2 n^2/2 multiply;  blocked FFT: p^2 n block/2 multiply, n/block call, and for each doubling of the
    block n/2 (p log2(2 length) transform + p^2 product).
    """

    pole: float
    pole_contact: float
    weight: float
    multiply: float
    transform: float
    product: float
    call: float

    def poles(self, n: int, poles: int, contacts: int) -> float:
        return n * poles * (self.pole + (contacts - 1) * self.pole_contact)

    def forming(self, n: int, poles: int, contacts: int) -> float:
        return n * poles * contacts * (contacts + 1) / 2 * self.weight

    def direct(self, n: int, contacts: int, block: int) -> float:
        return contacts**2 * n * min(block, n) / 2 * self.multiply

    def fft(self, n: int, contacts: int, block: int) -> float:
        cost, size = self.direct(n, contacts, block) + n // block * self.call, block
        while size < n:
            cost += n / 2 * (contacts * math.log2(2 * size) * self.transform + contacts**2 * self.product)
            size *= 2
        return cost


# Measured by benchmarks/speed.py on one core of an AVX-512 server processor at 2.6 GHz; the choice between engines
# depends on ratios only.
MEASURED = CostModel(
    pole=0.33e-9,
    pole_contact=0.2e-9,
    weight=0.08e-9,
    multiply=0.14e-9,
    transform=2.5e-9,
    product=1.7e-9,
    call=11e-6,
)


@dataclass(frozen=True)
class Plan:
    """The engines that the bodies run with, and the same in ``words``.

    ``by_poles``: for each body, whether its poles are marched (else they become step weights); ``block``: steps summed
    directly before the FFT takes them, all of a direct sum; ``seconds``: predicted time of the march on one core.
    """

    by_poles: tuple[bool, ...]
    block: int
    seconds: float
    words: str


def choose(
    kernels: Sequence[StepKernel],
    contacts: int,
    steps: int,
    engine: Engine = "auto",
    block: int | None = None,
) -> Plan:
    """Return the plan for the bodies' ``kernels`` (striker first); a given ``block`` is kept.

    Raises `ContactError`: unknown engine; "poles" where a body has none; a block below one step.
    """
    if engine not in get_args(Engine):
        raise ContactError(f"engine {engine!r} is unknown; choose from {', '.join(get_args(Engine))}")
    if block is not None and block < 1:
        raise ContactError(f"block = {block} must be at least one step")
    without = [kernel.engine for kernel in kernels if kernel.weights is not None]
    if engine == "poles" and without:
        raise ContactError(
            f"engine 'poles' is impossible: {without[0]} has step weights and no poles; use 'fft', 'direct' or 'auto'"
        )
    modal = [kernel.modal is not None and engine in ("auto", "poles") for kernel in kernels]
    candidates = [tuple(modal)]  # all poles marched, then without the largest body's, the two largest bodies', ...
    for number in sorted(range(len(kernels)), key=lambda i: -_count(kernels[i])) if engine == "auto" else ():
        modal[number] = False
        candidates.append(tuple(modal))
    blocks: tuple[int, ...] = (min(block or BLOCK, steps),)
    if engine == "direct" or (block is None and engine != "fft"):
        blocks = (steps,) if engine == "direct" else (min(BLOCK, steps), steps)
    plans = [
        _plan(kernels, each, contacts, steps, size, engine) for each in dict.fromkeys(candidates) for size in blocks
    ]
    best = min(plans, key=lambda plan: plan.seconds)
    first = min((plan for plan in plans if plan.by_poles == plans[0].by_poles), key=lambda plan: plan.seconds)
    return best if best.seconds < MARGIN * first.seconds else first


def _plan(
    kernels: Sequence[StepKernel], by_poles: tuple[bool, ...], contacts: int, steps: int, block: int, engine: Engine
) -> Plan:
    marched = sum(_count(k) for k, poles in zip(kernels, by_poles, strict=True) if poles)
    turned = sum(_count(k) for k, poles in zip(kernels, by_poles, strict=True) if not poles)
    weights = turned > 0 or any(k.weights is not None for k in kernels)
    weights = weights or not all(poles or k.modal is None for k, poles in zip(kernels, by_poles, strict=True))
    seconds = MEASURED.poles(steps, marched, contacts) + MEASURED.forming(steps, turned, contacts)
    if weights:
        seconds += MEASURED.fft(steps, contacts, block)
    names = ("striker", *["target"] * (len(kernels) - 1))
    parts = [
        f"{name}: {k.engine if k.modal is None or poles else f'step weights of {_count(k)} poles'}"
        for name, k, poles in zip(names, kernels, by_poles, strict=True)
    ]
    if weights:
        parts.append("direct sum" if block >= steps else f"FFT in blocks of {block} steps")
    choice = "chosen by the cost model" if engine == "auto" else "as asked"
    parts.append(f"{choice}, {seconds:.2g} s predicted")
    return Plan(by_poles, block, seconds, "; ".join(parts))


def _count(kernel: StepKernel) -> int:
    return 0 if kernel.modal is None else len(kernel.modal.omega) + len(kernel.modal.residual.rates)
