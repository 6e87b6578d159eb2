"""The gallery of Pan 2021: its printed numbers, the computed ones, figures and a comparison."""
