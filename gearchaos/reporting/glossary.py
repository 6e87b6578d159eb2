"""Meanings of the words that a report uses."""

import csv
import re
from pathlib import Path

with Path(__file__).with_name("glossary.csv").open(encoding="utf-8", newline="") as _file:
    GLOSSARY = {row["word"]: row["meaning"] for row in csv.DictReader(_file)}


def used_in(texts: str) -> dict[str, str]:
    """Return the words that occur in texts, in any case and number, and their meanings."""
    return {
        word: meaning
        for word, meaning in GLOSSARY.items()
        if re.search(rf"\b{re.escape(word)}(s|es)?\b", texts, re.IGNORECASE)
    }
