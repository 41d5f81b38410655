"""Control inside of a bound that is given in advance: prescribed performance, funnel control."""
