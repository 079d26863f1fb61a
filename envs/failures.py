"""What somebody's own code raised, in a sentence."""

import re
import sysconfig
import traceback
from pathlib import Path

import jax

LIBRARIES = tuple(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
LONGEST = 300  # letters of somebody else's message
# What JAX adds to a message: where it happened, which we say ourselves, and where to read more.
POSTSCRIPT = re.compile(r"(The error occurred while tracing|This Tracer was created|See https?://|-{20,}).*", re.DOTALL)
ADVICE: dict[type[BaseException], str] = {
    jax.errors.TracerArrayConversionError: "use jax.numpy in place of numpy",
    jax.errors.TracerBoolConversionError: "use jnp.where in place of a condition",
    jax.errors.TracerIntegerConversionError: "a traced number is no index or size",
    jax.errors.UnexpectedTracerError: "what one call computes, another one gets only from its state",
    SystemExit: "it ends the program",
}


def failure(error: BaseException) -> str:
    """Kind and message of a caught error, and the last line outside the libraries that it came through, if any."""
    frames = traceback.extract_tb(error.__traceback__)[1:]  # the first is the one that caught it
    foreign = ("<", *LIBRARIES, str(Path(__file__).parent / "tracing.py"))
    own = [frame for frame in frames if not frame.filename.startswith(foreign)]
    place = f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""
    advice = next((f"; {text}" for kind, text in ADVICE.items() if isinstance(error, kind)), "")
    said = ": ".join(filter(None, (type(error).__name__, _message(error))))
    return said + advice + place


def _message(error: BaseException) -> str:
    """Return the message as one line, and no longer than somebody would read."""
    text = " ".join(POSTSCRIPT.sub("", str(error)).split()).rstrip(".")
    return text if len(text) <= LONGEST else f"{text[:LONGEST].rsplit(' ', 1)[0]} ..."
