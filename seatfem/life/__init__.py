"""Fatigue life of the bodies of a run, and curves and maps of its margins; `seatfem.wings.life` plugs it in."""
