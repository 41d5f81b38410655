"""Where the paper's claims end: the same controller through every actuator."""
