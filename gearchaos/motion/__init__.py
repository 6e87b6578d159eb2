"""What a computed motion is: its period, its Lyapunov exponents, how far two motions differ."""
