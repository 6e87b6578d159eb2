"""What a computed record is: its period, its label, its exponent. NumPy alone."""
