"""The bounds that the proof supposes, and its constants, each with its provenance."""
