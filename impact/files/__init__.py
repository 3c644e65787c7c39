"""Files that are whole or absent when written, and bounded and checked when read."""
