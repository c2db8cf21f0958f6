"""Small GL programs of which the laboratory knows what they must give."""
