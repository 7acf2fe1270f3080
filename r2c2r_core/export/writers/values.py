"""What the writers of simulators say alike and no scene carries."""

ARMATURE = {"revolute": 0.005, "prismatic": 0.02}
"""kg m^2 and kg added to a joint for the solver's sake: under 2 % of a cabinet door's or a drawer's own."""

SURFACE_FRICTION = 0.7
"""Sliding friction of every surface: dry wood and laminate on each other lie between 0.25 and 0.7, rubber feet above."""
