"""A recorded episode as JSON for the player on the page.

Shapes that do not move are given once; every frame has its own shapes of what moves, and its own totals, as people say
them.
"""

from math import ceil
from typing import Any

from jmorl.playback import Recording
from jmorl.report.playback import STEP_SECONDS

LEAST_SECONDS = 1 / 30  # between two frames
DIGITS = 4


def episode_json(recording: Recording) -> dict[str, Any]:
    """Return an episode as frames no nearer than a thirtieth of a second, the last step included.

        {"seconds": between two frames, "still": [shape, ...],
         "frames": [{"step", "window", "shapes": [shape, ...], "totals": [M]}, ...]}

    Raises NoDrawing if the environment has none.
    """
    seconds = recording.environment.step_seconds or STEP_SECONDS
    stride = ceil(LEAST_SECONDS / seconds - 1e-9)
    steps = [*range(0, recording.steps, stride), recording.steps]
    scenes = [recording.scene(step).to_json() for step in steps]
    still = _still(scenes)
    totals = recording.readings
    frames = [
        {
            "step": step,
            "window": _rounded(scene["window"]),
            "shapes": _rounded(scene["shapes"][still:]),
            "totals": _rounded(totals[step].tolist()),
        }
        for step, scene in zip(steps, scenes, strict=True)
    ]
    return {"seconds": stride * seconds, "still": _rounded(scenes[0]["shapes"][:still]), "frames": frames}


def _still(scenes: list[dict[str, Any]]) -> int:
    """Count how many of the first shapes are the same in every scene: later ones are drawn over them."""
    first = scenes[0]["shapes"]
    for index, shape in enumerate(first):
        if any(len(scene["shapes"]) <= index or scene["shapes"][index] != shape for scene in scenes):
            return index
    return len(first)


def _rounded(content: Any) -> Any:
    """Return JSON's types with numbers of a few digits. Numbers come first: there are most of them."""
    if isinstance(content, float):
        return round(float(content), DIGITS)
    if isinstance(content, list | tuple):
        return [_rounded(value) for value in content]
    if isinstance(content, dict):
        return {name: _rounded(value) for name, value in content.items()}
    return content
