"""One file a format; `table.py` lists them."""
