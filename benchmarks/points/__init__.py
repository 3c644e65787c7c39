"""Plates that land on points of a lip: a program of its own, by numpy and scipy alone, without code of the product.

It is the reference of a tilted landing (`points/flapper_landing.py`). The plate is Mindlin's, in spectral elements
on mapped quadrilaterals; the seat is a body of revolution in spectral elements and Fourier harmonics, with its
waves; contact is a law at each of many points around and across the land; time is marched by Strang splitting: every
mode flies freely and exactly for a step, and is then kicked by the forces at the points.
"""
