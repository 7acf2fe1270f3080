"""A furniture run: orthomosaic -> line evidence -> XY-cut into panels -> handles; `run` puts them together, once a plane."""
