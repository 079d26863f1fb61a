"""The program `jmorl`, and `python -m jmorl`: the command line, once JAX can be imported."""

import sys


def main() -> int:
    """Run the command that the arguments say. Returns the exit code."""
    try:
        import jax  # noqa: F401
    except Exception as error:  # it is not there, or a variable of its own has a value that it cannot read
        print(f"jmorl: JAX cannot be imported: {error}", file=sys.stderr)
        return 2
    from jmorl.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(main())
