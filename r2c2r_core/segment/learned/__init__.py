"""Learned segmenters: `sam_video` predicts masks, `voting` and `fuse` add depth, `measure` measures, `session` combines."""
