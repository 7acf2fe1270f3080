"""Appliances: `find` finds the front at clicks, `fit` fits its box by least squares to the evidence of `edges` and `faces`."""
