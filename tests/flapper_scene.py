"""The flapper of the gallery, for tests that need no other table of it."""

from tests.gallery import FLAPPER

__all__ = ["FLAPPER"]
