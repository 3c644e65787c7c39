"""Pictures of bodies: meshes, modes, faces, fits, and motion, drawn in a separate process."""
