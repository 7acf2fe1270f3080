"""Appliances: `find` takes clicks to the front, `fit` is the method (least squares) on `edges` and `faces` as evidence."""
