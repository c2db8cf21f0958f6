"""What pictures cost and how far they are off, measured."""
