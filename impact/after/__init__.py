"""What is read off an impact: results, energies, measures, stresses, regimes, advice."""
