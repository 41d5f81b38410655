"""What a reproduced paper is, and its page: the same for every paper."""
