"""The loops over steps, of one contact and of several."""

from __future__ import annotations

import numpy as np

from impact.march.film import FAR
from impact.march.loop.compiled import compiled
from impact.march.loop.complementarity import active_set_from
from impact.march.loop.films import filmed_force
from impact.march.loop.forces import contact_force
from impact.march.loop.past import advance, advance_many, past
from impact.march.loop.strides import flight
from impact.march.loop.sweeps import alone, by_sweeps, linear_laws

WAIT = 32  # steps before a stride is tried again that was too long


@compiled(nogil=True)
def march_one(
    start, stop, rows, state, free, memory, recent, block, w0, law, film, user, dt, rest, strides, force, gap, pulls
):
    """March the steps ``start``..``stop``-1 of one contact; force (n,) and gap (n + 1,) are filled in place.

    rows: `Poles.folded`; state: (q, p). free (n,): gap at the end of each step without contact. memory (n,): what
    finished blocks add. recent: `BlockedSum.recent`. law: (code, rule, three numbers). film: its three numbers; None: a
    march without any is compiled on its own. rest: force carried since ever. strides: lengths, powers and
    swing of `Strides`; where there are any, force is zero beforehand. pulls (n,): the film's part of the force.
    """
    q, p = state
    code, rule, a, b, c = law
    level, n, wait = 0, start, start
    psi, ahead, line, carried = np.empty((1, q.size)), np.empty((2, q.size)), np.empty((3, 1)), np.empty(1)
    carried[0], opens, gaps = w0 * rest, free.reshape(-1, 1), gap.reshape(-1, 1)
    clear = np.zeros(1)
    if film is not None:
        clear[0] = FAR * film[1]
    for k in range(q.size):
        psi[0, k] = 1.0
    while n < stop:
        if strides[0].size > 0 and n >= wait and n > 0 and force[n - 1] == 0.0 and gap[n] > clear[0]:
            flown, level = flight(n, stop, strides, level, psi, q, p, ahead, line, opens, carried, clear, gaps)
            n += flown
            if flown > 0:
                continue
            wait = n + WAIT
        last = force[n - 1] - rest if n > 0 else 0.0
        opening = free[n] + advance(rows, q, p, last)
        if recent.size > 0:
            opening += memory[n] + past(recent, force, rest, n - n % block, n)
        opening -= w0 * rest
        if film is not None:
            pressed, pulled = filmed_force(code, rule, a, b, c, user, film, -opening, -gap[n], w0, w0, dt)
            f, pulls[n] = pressed + pulled, pulled
        else:
            f = contact_force(code, rule, a, b, c, user, -opening, -gap[n], w0, w0, dt)
        force[n] = f
        gap[n + 1] = opening + w0 * f
        n += 1


@compiled(nogil=True)
def march_many(
    start, stop, poles, state, free, memory, recent, block, w0, laws, films, user, dt, rest, strides, force, gap, pulls
):
    """Do the same for p contacts: force, pulls and memory (p, n), gap (n + 1, p), free (n, p), recent (p, p, block), w0
    (p, p), films (p, 3), the first number 0 of a contact without one. Returns how many steps' forces were not found, as
    `by_sweeps` says."""
    rows, psi, along = poles
    unsolved = 0
    q, v = state
    codes, rules, numbers = laws
    contacts = rest.size
    carried, pen, before = np.zeros(contacts), np.empty(contacts), np.empty(contacts)
    opening, last, warm = np.empty(contacts), np.zeros(contacts), np.zeros(contacts)
    drive = np.empty(q.size)
    linear, shifted = linear_laws(codes, rules, numbers, w0)
    low, held = np.empty((contacts, contacts)), np.full(contacts + 1, -1)
    clear = np.zeros(contacts)
    if films is not None:
        linear = False
    heard = np.zeros((contacts, contacts), dtype=np.bool_)  # a seat and a stopper do not hear each other
    for c in range(contacts):  # written out: numpy's assignments and products take seconds to compile
        warm[c] = force[c, start - 1] if start > 0 else 0.0
        if films is not None and films[c, 0] > 0.0:
            clear[c] = FAR * films[c, 1]
        for d in range(contacts):
            carried[c] += w0[c, d] * rest[d]
            for m in range(recent.shape[2]):
                if recent[c, d, m] != 0.0:
                    heard[c, d] = True
                    break
    level, n, wait = 0, start, start
    ahead, line = np.empty((2, q.size)), np.empty((3, contacts))
    while n < stop:
        if strides[0].size > 0 and n >= wait and n > 0:
            apart = True
            for c in range(contacts):
                apart = apart and force[c, n - 1] == 0.0 and gap[n, c] > clear[c]
            if apart:
                flown, level = flight(n, stop, strides, level, psi, q, v, ahead, line, free, carried, clear, gap)
                n += flown
                if flown > 0:
                    continue
                wait = n + WAIT
        for c in range(contacts):
            last[c] = force[c, n - 1] - rest[c] if n > 0 else 0.0
            opening[c] = free[n, c] - carried[c]
        advance_many(rows, psi, along, q, v, drive, last, opening)
        for c in range(contacts):
            if recent.size > 0:
                opening[c] += memory[c, n]
                for d in range(contacts):
                    if heard[c, d]:
                        opening[c] += past(recent[c, d], force[d], rest[d], n - n % block, n)
            pen[c], before[c] = -opening[c], -gap[n, c]
        if linear:
            active_set_from(shifted, pen, warm, low, held)
        elif not by_sweeps(codes, rules, numbers, user, films, pen, before, w0, dt, warm):
            unsolved += 1
        closed = gap[n + 1]
        for c in range(contacts):
            closed[c] = opening[c]
        for d in range(contacts):
            if warm[d] != 0.0:
                for c in range(contacts):
                    closed[c] += w0[d, c] * warm[d]
        for c in range(contacts):
            force[c, n] = warm[c]
            if films is not None and films[c, 0] > 0.0:
                pressed, pulled = alone(codes, rules, numbers, user, films, pen, before, w0, dt, warm, c, 0.0)
                pulls[c, n] = pulled if pressed > 0.0 else warm[c]
        n += 1
    return unsolved
