"""Makes the models of the scenes from nothing but numbers: geometry, textures, files."""
