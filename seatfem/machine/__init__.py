"""What this machine has to offer."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
