"""Small GL programs whose exact results are known."""
