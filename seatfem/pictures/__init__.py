"""Pictures of bodies: meshes, modes, faces, fits; drawn in a process of their own."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
