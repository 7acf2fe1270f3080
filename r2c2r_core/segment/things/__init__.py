"""Free-standing things: `thing` cuts large ones from the surface, `visual_hull` carves small ones, `found` has both."""
