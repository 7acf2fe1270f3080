"""Furniture runs: an orthomosaic divided into fronts by the most probable partition; `run` assembles them."""
