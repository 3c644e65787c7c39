"""Report of a run: one web page that needs no network."""
