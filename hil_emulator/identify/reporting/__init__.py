"""Output of a result: page, pictures, tables, and a layer of configuration."""
