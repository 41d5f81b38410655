"""What rounding of intermediate values may do to results: of expressions, of functions called."""
