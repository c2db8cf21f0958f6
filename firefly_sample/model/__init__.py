"""Model files as scenes: glTF by its specification, other formats through trimesh."""
