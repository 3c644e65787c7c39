"""Resources of this computer: memory, libraries, versions."""
