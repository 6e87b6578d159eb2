"""The classical Runge-Kutta method of order 4, with steps split at crossings."""
