# SPDX-License-Identifier: MIT
"""`python -m mpf`: the program `mpf`."""

from mpf.program import main

if __name__ == "__main__":
    main()
