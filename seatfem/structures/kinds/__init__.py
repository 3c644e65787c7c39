"""The kinds of bodies that scenes may name."""
