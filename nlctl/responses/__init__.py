"""What a simulation is asked and returns, whichever engine computes it."""
