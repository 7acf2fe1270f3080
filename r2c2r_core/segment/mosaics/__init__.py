"""A vertical plane as its frames show it: orthomosaic, line evidence, relief, the networks' odds, edges and handles on it."""
