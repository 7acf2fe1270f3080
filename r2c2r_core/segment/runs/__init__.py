"""A furniture run: its orthomosaic cut into panels (XY-cut), face frames and stiles told apart; `run` puts it together."""
