# ruff: noqa: I001 (one import a module)
from seatfem.study.runs import (
    afterwards as afterwards,
    calculix_contact as calculix_contact,
    horizon as horizon,
    kept as kept,
    lives as lives,
    next_round as next_round,
    pictures as pictures,
    pipeline as pipeline,
    round as round,
    rounds as rounds,
    seat_fields as seat_fields,
    seat_stress as seat_stress,
    stress_spots as stress_spots,
    stress_wave as stress_wave,
    stresses as stresses,
    summary as summary,
)
