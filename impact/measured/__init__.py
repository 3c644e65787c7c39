"""Green's functions from measurements: reading, passivity, pole fits."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
