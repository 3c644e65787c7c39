"""Gas through a reed valve, and in the cylinder behind it."""
