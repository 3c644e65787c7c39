"""Mass, stiffness and damping matrices by finite elements."""
