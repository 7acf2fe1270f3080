"""Appliances: `find` takes clicks to the front, `box` measures it; the others refine that box by depth and photographs."""
