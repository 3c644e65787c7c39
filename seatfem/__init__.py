"""From the geometry of a seat to its Green's function, and the application around it."""
