"""What pages are composed of: loops, runs, proofs and studies as sections of a report."""
