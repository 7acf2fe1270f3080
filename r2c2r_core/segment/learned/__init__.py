"""Learned segmenters: `sam_video` draws masks, `voting` and `fuse` bring in depth, `measure` measures, `session` joins."""
