"""Translation of the model's Python text to C, for tools and controllers without Python."""
