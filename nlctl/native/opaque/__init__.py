"""Functions of blocks that are called unchanged, since no expressions were found of them."""
