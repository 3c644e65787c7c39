"""Pictures, tables and progress bars."""
