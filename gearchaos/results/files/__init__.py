"""Result files: written complete or not at all, kept block by block, read and verified."""
