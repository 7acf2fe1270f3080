"""What the linter looks for, one file a subject; each rule is a line of `table.py`."""
