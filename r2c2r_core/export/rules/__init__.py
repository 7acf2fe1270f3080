"""Rules of the linter, one file per subject; each rule is a line of `table.py`."""
