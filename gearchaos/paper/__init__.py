"""The gallery of Pan 2021: what the paper prints, the same computed, drawn, compared and told."""
