"""Taylor series: pieces of steps up to the next crossing, for systems of many elements."""
