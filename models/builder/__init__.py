"""Makes the models of the forest from nothing but numbers: geometry, textures, files."""
