"""Reading a diagram: its wiring, the order of evaluation, feedthrough, algebraic loops."""
