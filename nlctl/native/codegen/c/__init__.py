"""A plan as C99: the same operations in the same order as the machine code that rounds alike."""
