"""Errors put into the product one by one: which tests find each. `python -m tests.mutations --help` says how."""
