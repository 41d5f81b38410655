"""What the host machine gives: files replaced in one step, processes that end with their parent."""
