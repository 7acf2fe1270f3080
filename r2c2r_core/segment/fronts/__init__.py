"""Fronts: `front` finds the panel under the clicks, `units` adds a size prior, `clicked_open` maps clicks on open fronts."""
