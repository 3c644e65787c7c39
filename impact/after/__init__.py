"""What is read off an impact: results, energies, measures, stresses, regimes, advice."""

from impact.names import lazy_names

__getattr__ = lazy_names(__name__)
