"""The compiled march: laws, several contacts at one time level, and the loops over steps."""
