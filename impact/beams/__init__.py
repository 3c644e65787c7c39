"""Modes of straight beams in closed form, one family a file."""
