"""Green's functions from measurements: reading, passivity, pole fits."""
