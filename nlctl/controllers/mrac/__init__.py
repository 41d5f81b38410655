"""Model reference adaptive control (MRAC): reference model, error, regressors, weights, laws."""
