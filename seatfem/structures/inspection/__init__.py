"""What the files that a scene names really hold, read before anything is planned or computed: once in a process."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
