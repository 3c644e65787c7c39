"""Contact problems: contacts between a striker and its targets."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from impact.bodies.body import AtRest, Body, as_body
from impact.greens.base import Array, GreensFunction
from impact.march.laws import NO_FILM, ROUGH, Law, Parameters, Signorini, SqueezeFilm
from impact.notices import SeatfemError
from impact.quantities import as_html, brief, brief_value, check_numbers

SIGNORINI: Final = Signorini()
MOST_CONTACTS: Final = 8192
"""Most contacts of a problem: the compliance matrix between all contacts then takes 0.5 GB."""


class ContactError(SeatfemError, ValueError):
    """A contact problem that cannot be solved as posed; the message says what to change."""


class RigidContactError(ContactError):
    """A rigid law between two bodies without an instantaneous response, g(0+) = 0."""


@dataclass(frozen=True)
class Contact:
    """One place where the striker may touch a target.

    Attributes:
        target: the body that is touched, or its Green's function if it is at rest; the same object for several contacts
            on one body.
        port, striker_port: port of each body (name or index).
        gap: gap between the undeformed bodies [m]; negative for an interference.
        law: contact law.
        film: fluid film in the open gap, in addition to the law; ``None`` without one.
        side: +1 for a target below the striker (a seat), -1 for one above it (a stopper):
            gap(t) = gap + side (u_striker - u_target), the motion of their bases included.
    """

    target: Body
    port: str | int = 0
    gap: float = 0.0
    law: Law = field(default_factory=Signorini)
    side: int = 1
    striker_port: str | int = 0
    film: SqueezeFilm | None = None

    __repr__ = brief

    @property
    def film_parameters(self) -> Parameters:
        """Return the parameters of the film for the time loop; the first is 0 without a film."""
        return NO_FILM if self.film is None else self.film.parameters

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", as_body(self.target))
        check_numbers(ContactError, gap=self.gap)
        if not math.isfinite(self.gap):
            raise ContactError(f"gap = {self.gap} m must be finite")
        if self.side not in (-1, 1):
            raise ContactError(f"side = {self.side} must be +1 (seat) or -1 (stopper)")
        if not hasattr(self.law, "parameters"):
            words = "is no contact law; give one, as impact.Hertz(stiffness=1e9)"
            raise ContactError(f"law = {brief_value(self.law)} {words}")
        if self.film is not None and self.law.code >= ROUGH:
            raise ContactError(
                f"a film beside a {type(self.law).__name__}: how the fluid in a joint that stays closed moves is not "
                "known; take another law, or no film"
            )
        self.target.greens.port_index(self.port)


@dataclass(frozen=True, init=False)
class ContactProblem:
    """A striker with one contact on a target, or with several contacts.

    ``ContactProblem(striker, target, gap=, law=, film=, striker_port=, target_port=)`` is short for
    ``ContactProblem(striker, contacts=[Contact(target, port=target_port, gap=gap, law=law, film=film)])``. With
    ``preload`` the bodies start in static equilibrium under their loads and contact forces (a reed pressed on its
    seat). A Green's function in place of a body means a body at rest.
    """

    striker: Body
    contacts: tuple[Contact, ...]
    preload: bool

    def __init__(
        self,
        striker: Body | GreensFunction,
        target: Body | GreensFunction | None = None,
        *,
        gap: float = 0.0,
        law: Law = SIGNORINI,
        film: SqueezeFilm | None = None,
        striker_port: str | int = 0,
        target_port: str | int = 0,
        contacts: list[Contact] | tuple[Contact, ...] = (),
        preload: bool = False,
    ) -> None:
        striker = as_body(striker)
        if (target is None) == (len(contacts) == 0):
            raise ContactError("give either a target or a list of contacts")
        if target is None and (gap, law, film, striker_port, target_port) != (0.0, SIGNORINI, None, 0, 0):
            raise ContactError(
                "gap, law, film and ports belong to each contact of the list: impact.Contact(target, gap=...)"
            )
        if target is not None:
            contacts = (Contact(as_body(target), target_port, gap, law or SIGNORINI, 1, striker_port, film),)
        if len(contacts) > MOST_CONTACTS:
            raise ContactError(
                f"{len(contacts)} contacts: at most {MOST_CONTACTS} are solved together, whose compliances with each "
                f"other take {8e-9 * MOST_CONTACTS**2:.2g} GB; join some of them"
            )
        for contact in contacts:
            striker.greens.port_index(contact.striker_port)
        user_laws = [c.law.compiled for c in contacts if hasattr(c.law, "compiled")]
        if any(law is not user_laws[0] for law in user_laws):
            raise ContactError(
                "the contacts have different laws of your own: one CompiledLaw or PlainLaw per problem, beside any "
                "built-in ones; give the same object to all of them"
            )
        object.__setattr__(self, "striker", striker)
        at_rest: dict[int, Body] = {}  # one body for each Green's function that is given in place of a body
        targets = [
            at_rest.setdefault(id(c.target.greens), c.target) if isinstance(c.target, AtRest) else c.target
            for c in contacts
        ]
        contacts = tuple(replace(c, target=target) for c, target in zip(contacts, targets, strict=True))
        object.__setattr__(self, "contacts", contacts)
        object.__setattr__(self, "preload", preload)

    def __str__(self) -> str:
        number_of = {id(body): number for number, body in enumerate(self.targets)}
        lines = [
            f"contact {number}: gap {c.gap:g} m, {c.law}, {f'{c.film}, ' if c.film else ''}"
            f"{'seat' if c.side > 0 else 'stopper'}, port {c.port} of "
            f"target {number_of[id(c.target)]}, port {c.striker_port} of the striker"
            for number, c in enumerate(self.contacts[:2])
        ]
        more = len(self.contacts) - len(lines)
        bodies = [f"striker: {self.striker}", *(f"target {n}: {body}" for n, body in enumerate(self.targets[:3]))]
        rows = [*lines, *([f"{more} contacts more"] if more else []), *bodies]
        start = ", preloaded" if self.preload else ""
        return f"ContactProblem, {len(self.contacts)} contacts{start}\n" + "\n".join(rows)

    __repr__ = __str__
    _repr_html_ = as_html

    @property
    def target(self) -> Body:
        """Return the target of the first contact."""
        return self.contacts[0].target

    @property
    def targets(self) -> tuple[Body, ...]:
        """Return the distinct targets, in order of first appearance."""
        return tuple({id(contact.target): contact.target for contact in self.contacts}.values())

    @property
    def bodies(self) -> tuple[Body, ...]:
        """Return the striker, then the targets."""
        return (self.striker, *self.targets)

    @property
    def has_moving_base(self) -> bool:
        """Return whether the base of a body moves."""
        return any(body.base is not None for body in self.bodies)

    def find_base_gaps(self, time: Array) -> Array:
        """Return the (n, contacts) changes of the gaps by moving bases [m]; zeros, which take no memory, if none
        moves."""
        if not self.has_moving_base:
            return np.broadcast_to(0.0, (len(time), len(self.contacts)))
        striker = self.striker.find_base_displacement(time)
        return np.stack([c.side * (striker - c.target.find_base_displacement(time)) for c in self.contacts], axis=1)

    def directions(self, body: Body) -> Array:
        """Return the (ports of ``body``, contacts) signs +1, 0 or -1 of a contact force N >= 0 on each port."""
        signs = np.zeros((len(body.greens.ports), len(self.contacts)))
        for c, contact in enumerate(self.contacts):
            if body is self.striker:
                signs[body.greens.port_index(contact.striker_port), c] += contact.side
            if body is contact.target:
                signs[body.greens.port_index(contact.port), c] -= contact.side
        return signs
