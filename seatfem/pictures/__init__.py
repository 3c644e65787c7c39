"""Pictures of bodies: meshes, modes, faces, fits, and motion, drawn in a separate process."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
