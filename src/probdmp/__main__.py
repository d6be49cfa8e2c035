"""`python -m probdmp`."""

from probdmp.cli import main

if __name__ == "__main__":
    main()
