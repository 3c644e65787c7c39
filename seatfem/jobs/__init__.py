"""Jobs in separate processes: workers that end with their parent, private folders, journals."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
