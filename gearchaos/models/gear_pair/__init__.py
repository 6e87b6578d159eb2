"""Catalogue data of a gear pair, and the dimensionless groups that follow from them."""
