"""Green's functions from measurements: reading, pole fits."""
