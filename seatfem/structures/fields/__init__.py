"""Stress in bodies of finite elements: at points and on surfaces, from the contact forces of a run."""
