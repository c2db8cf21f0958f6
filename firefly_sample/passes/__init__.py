"""Everything about each pass; the name of a pass is its shaders' stem and its timer's key."""
