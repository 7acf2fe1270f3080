"""Training of the small networks that come with r2c2r."""
