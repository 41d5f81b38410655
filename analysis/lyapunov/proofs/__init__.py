"""What every proof has: its record, the iteration that closes a box, its result, and its file."""
