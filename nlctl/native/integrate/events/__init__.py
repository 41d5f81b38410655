"""Events inside a step: where they are, what may be passed over, and what is just before one."""
