"""Functions of blocks that are called as they stand, since no expressions were found of them."""
