"""The error of everything that makes a finite-element model."""


class ModelError(ValueError):
    """A mesh, material or matrix from which no model can be made; the message names object, number and remedy."""
