"""Follows every link of the READMEs below a folder. Usage: links.py FOLDER"""

import pathlib
import sys

from markdown import broken_links

if __name__ == "__main__":
    faults, followed = broken_links(pathlib.Path(sys.argv[1]))
    print("\n".join(faults) or f"links.py: {followed} links hold", file=sys.stderr if faults else sys.stdout)
    sys.exit(1 if faults or not followed else 0)
