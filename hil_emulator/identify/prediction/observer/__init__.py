"""The predictor of a complete actuator, and the interface of all predictors that fits use."""
