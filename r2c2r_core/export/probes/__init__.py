"""Scripts that load a bundle in an engine and write down what it holds; each runs by its path, in a process of its own."""
