"""Green's functions from measured frequency responses."""
