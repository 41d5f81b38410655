"""The loop that a proof is about: read from its wiring, checked, instrumented, simulated."""
