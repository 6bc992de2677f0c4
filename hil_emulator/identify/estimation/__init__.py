"""Maximum a posteriori fits of the model's parameters to frozen experiments."""
