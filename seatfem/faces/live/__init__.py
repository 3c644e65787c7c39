"""A page in the browser of this machine: sliders of a scene, and its force, lift and measures as they change."""
