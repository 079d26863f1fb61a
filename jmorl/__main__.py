"""`python -m jmorl`: the command line without an installed script."""

from jmorl.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
