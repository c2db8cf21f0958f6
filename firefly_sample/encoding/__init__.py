"""Images as the content of files, and back: pictures, data, and films."""
