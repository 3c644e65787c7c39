"""Damaged files of every format through the program: no traceback, no hang, no blow-up of memory, no half of a file.

`python -m tests.fuzz` carries out the cases of a seed, each under limits, and writes the table of verdicts; `--growth`
makes each kind of line so many that time or memory that grows with a square is seen.
"""
