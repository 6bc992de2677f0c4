"""What predicts the next sample: the model as a Kalman filter, or one balance alone."""
