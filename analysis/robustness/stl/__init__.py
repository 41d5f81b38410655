"""Signal temporal logic: formulas over signals, requirements, their margins."""
