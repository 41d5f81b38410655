"""What is uncertain, bound to a diagram, and which of its points are run."""
