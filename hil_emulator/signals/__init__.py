"""What can be read, set and asked by name: columns of a recording, inputs, conditions."""
