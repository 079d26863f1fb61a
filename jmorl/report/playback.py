"""A recorded episode as a file: an animation (gif), a film (mp4), or a strip of poses (png)."""

import subprocess
from collections.abc import Iterator
from itertools import chain, repeat
from math import ceil
from pathlib import Path

from PIL import Image

from jmorl.playback import PlaybackError, Recording
from jmorl.report.frames import film_frame, strip
from jmorl.storage.files import written_whole

KINDS = {".gif": 640, ".mp4": 640, ".png": 1280}  # -> default width in pixels
STEP_SECONDS = 1 / 30  # shown for each step of an environment whose steps have no duration
LEAST_SECONDS = 0.02  # for each picture; what is faster, players slow down
HOLD_SECONDS = 1.0  # on the last picture


def check_playback(path: Path, force: bool = False) -> None:
    """Raise PlaybackError, saying what to do, if no playback can be written to `path`."""
    kind = path.suffix.lower()
    if kind not in KINDS:
        raise PlaybackError(f"out: {path} must end in {', '.join(KINDS)}, which says what is made")
    if not path.parent.is_dir():
        raise PlaybackError(f"out: there is no folder {path.parent}")
    if path.is_dir() or (path.exists() and not force):
        raise PlaybackError(f"out: {path} already exists; choose another file, or overwrite it with --force")
    if kind == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError as error:
            raise PlaybackError("out: mp4 needs an encoder: pip install 'jmorl[video]', or make a .gif") from error


def write_playback(recording: Recording, path: Path, width: int | None = None) -> None:
    """Draw the episode into a file of the kind that its name ends in, so many pixels wide.

    Raises NoDrawing if the environment has none. `check_playback` says whether the file can be written.
    """
    kind = path.suffix.lower()
    width = (width or KINDS[kind]) // 2 * 2
    seconds = recording.environment.step_seconds or STEP_SECONDS
    stride = ceil(LEAST_SECONDS / seconds)
    frame_seconds = stride * seconds
    with written_whole(path) as temporary:
        if kind == ".png":
            strip(recording, width).save(temporary, format="png")
        else:
            write = _write_gif if kind == ".gif" else _write_mp4
            frames = _frames(recording, stride, width, hold=ceil(HOLD_SECONDS / frame_seconds))
            write(frames, temporary, frame_seconds)


def _frames(recording: Recording, stride: int, width: int, hold: int) -> Iterator[Image.Image]:
    """Every `stride`-th picture, and the last for a while."""
    for step in range(0, recording.steps, stride):
        yield film_frame(recording, step, width)
    last = film_frame(recording, recording.steps, width)
    yield from repeat(last, hold)


def _write_gif(frames: Iterator[Image.Image], path: Path, seconds: float) -> None:
    """One palette for all pictures, from the first: their colours are the same."""
    first = next(frames).quantize(64)
    rest = (frame.quantize(palette=first, dither=Image.Dither.NONE) for frame in frames)
    milliseconds = 10 * round(100 * seconds)  # the format counts in hundredths
    first.save(path, format="gif", save_all=True, append_images=rest, duration=milliseconds, loop=0)


def _write_mp4(frames: Iterator[Image.Image], path: Path, seconds: float) -> None:
    """H.264 in the pixel format that every browser plays. Raises OSError with the encoder's words if it fails."""
    import imageio_ffmpeg

    first = next(frames)
    size = "x".join(map(str, first.size))
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{1 / seconds:.6g}", "-i", "-"]
    target = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-crf", "20", "-movflags", "+faststart", "-f", "mp4", str(path)]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-y", *source, *target]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as encoder:
        assert encoder.stdin
        for frame in chain([first], frames):
            encoder.stdin.write(frame.tobytes())
        _, message = encoder.communicate()
    if encoder.returncode:
        raise OSError(f"the encoder failed: {message.decode(errors='replace').strip()}")
