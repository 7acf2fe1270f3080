"""Writers, one file per format; `table.py` lists them."""
