"""Proposals: panels that pass as fronts and free-standing clusters, each named and with the click that confirms it."""
