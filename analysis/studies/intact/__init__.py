"""Whether a run folder is intact: its sealed record, and the shapes of its files."""
