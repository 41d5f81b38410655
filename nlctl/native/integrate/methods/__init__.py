"""Methods of integration: an explicit pair and a Rosenbrock method, both of orders 5(4)."""
