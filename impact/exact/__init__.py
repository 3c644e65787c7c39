"""Green's functions in closed form: rods, springs, infinite beams and plates, the half-space."""
