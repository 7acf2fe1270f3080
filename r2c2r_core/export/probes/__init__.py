"""Scripts that load a bundle in an engine and write out its values; each runs by path in a separate process."""
