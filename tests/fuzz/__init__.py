"""Damaged files of every format through the program: no traceback, no hang, no blow-up of memory, no half of a file.

`python -m tests.fuzz` carries out the cases of a seed, each under limits, and writes the table of verdicts.
"""
