"""The commands of ``firefly``, one a file."""
