"""Everything with which a user interacts: the command line, tables, sentences and progress bars."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
