"""``python -m gearchaos.configuration`` is the command ``gearchaos configuration``."""

from gearchaos.configure import main

main.start(__name__)
