"""Files that are complete or absent when written, and limited in size and checked when read."""
