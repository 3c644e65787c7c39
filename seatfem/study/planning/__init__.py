"""Which model a scene requires for the accuracy it asks for: every open key chosen, with reason, cost and error."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
