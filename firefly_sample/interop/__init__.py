"""Other libraries' scenes: each is imported when it is first used, and none has to be installed."""
