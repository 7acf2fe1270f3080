"""Free-standing objects: `thing` cuts large ones from the surface, `visual_hull` carves small ones, `found` wraps both."""
