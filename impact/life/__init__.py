"""Fatigue under repeated blocks of stress: cycles, mean stress, S-N curves, Miner's sum, criteria of several axes."""
