"""The weight-free segmenter: `session` is its public class, `finders` sends clicks to the room that answers them."""
