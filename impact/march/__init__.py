"""The march over time: contact laws, compiled loops, memories of the past, the stepper."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
