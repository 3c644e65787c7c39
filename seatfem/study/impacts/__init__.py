"""The contact problem of a scene, its measures, and what changes them: the parts of an error budget."""
