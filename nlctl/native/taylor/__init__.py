"""Taylor's method: the coefficients of the solution, from the expressions of a diagram."""
