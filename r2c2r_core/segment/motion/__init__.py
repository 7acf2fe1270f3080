"""Motion of leaves relative to their unit: `track` estimates the joint of a leaf and its state in every frame, from depth."""
