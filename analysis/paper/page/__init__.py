"""The page of the paper's reproduction, and its part on the proof."""
