"""Frame sequences: rendered, written to files, and described by a manifest."""
