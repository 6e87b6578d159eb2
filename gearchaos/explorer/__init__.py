"""The page of a result: diagrams to zoom into, and the motion of the lane that is clicked."""
