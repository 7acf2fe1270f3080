"""Motion of a leaf against its unit: `track` finds the joint it hangs on and its state in every frame, from depth."""
