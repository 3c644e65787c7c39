"""A run as one web page that needs no network."""
