"""What is known of a body before any model of it: struck patch, surrogate, element sizes, cost."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
