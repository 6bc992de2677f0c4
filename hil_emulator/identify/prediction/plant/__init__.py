"""The configured machine as a state-space model with parameters to fit, used by all predictors."""
