"""Statistics of residuals (noise, autocorrelation, Huber's loss), used by predictors and fits."""
