"""The program `jmorl`, and `python -m jmorl`: the command line, once JAX can be imported."""

import sys


def main() -> int:
    """Run the command that the arguments say. Returns the exit code."""
    from jmorl.module_path import REFUSED

    if REFUSED:
        print(f"jmorl: JAX cannot be imported: {REFUSED}", file=sys.stderr)
        return 2
    from jmorl.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(main())
