"""Resources of this computer: memory, libraries, versions."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
