"""A vertical plane in its frames: orthomosaic, line evidence, relief, network odds, edges and handles on it."""
