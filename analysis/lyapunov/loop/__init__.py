"""The loop that a proof speaks of: read from its wiring, checked, instrumented, simulated."""
