"""Furniture runs: an orthomosaic cut into panels (XY-cut), with face frames and stiles identified; `run` assembles them."""
