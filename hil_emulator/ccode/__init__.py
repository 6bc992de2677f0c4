"""The model in C: its own text, translated once, for tools and controllers without Python."""
