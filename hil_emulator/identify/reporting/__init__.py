"""What a person or the next run gets: page, pictures, tables, layer of configuration."""
