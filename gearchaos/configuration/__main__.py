"""``python -m gearchaos.configuration`` is the command ``gearchaos configuration``."""

import sys

from gearchaos.configure import main

if __name__ == "__main__":
    sys.exit(main())
