"""One pass a file. A file's name is its shader's stem, its timer's key and its page in the docs."""
