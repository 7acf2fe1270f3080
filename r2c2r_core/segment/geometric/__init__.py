"""Weight-free segmenter: `session` is its public class, `finders` routes clicks to the package that segments them."""
