"""Fronts: `front` is the method (the panel under the clicks), `units` its size prior, `articulation` its open states."""
