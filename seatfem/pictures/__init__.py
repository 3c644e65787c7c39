"""Pictures of bodies: meshes, modes, faces, fits; drawn in a process of their own."""
