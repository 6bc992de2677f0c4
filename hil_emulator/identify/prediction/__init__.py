"""Predictors: Kalman filter and single balances; `instrumentation` chooses one for the channels."""
