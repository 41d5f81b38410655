"""One module per competitor; each has ``solvers(problem)``, which may raise `UnavailableError`."""
