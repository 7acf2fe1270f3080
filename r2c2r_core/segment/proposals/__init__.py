"""Proposals: panels that pass as fronts, and free-standing clusters, each with a category and the click that confirms it."""
