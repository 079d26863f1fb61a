"""The two rights that a page can have: to steer, or to watch alone."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from inspect import iscoroutinefunction
from typing import Concatenate, Literal, ParamSpec, Protocol, TypeVar, cast

from jmorl.studio import words

Tone = Literal["hint", "warning", "failure"]


@dataclass(frozen=True)
class Access:
    """What the address of a page allows, as the server has found when it served the page."""

    watching: bool = False  # and nothing else; it steers if not
    link: str = ""  # address at which others can watch, to hand on; nothing where there is none
    guarded: bool = False  # steering takes a token


STEERS = Access()


class HasAccess(Protocol):
    """A browser tab that may only watch."""

    access: Access
    tell: Callable[[str, Tone], None]


AnyTab = TypeVar("AnyTab", bound=HasAccess)
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def steering(
    command: Callable[Concatenate[AnyTab, Arguments], Result],
) -> Callable[Concatenate[AnyTab, Arguments], Result]:
    """Make a command of a tab one that steers: a tab that only watches says so instead. The command returns nothing."""

    @wraps(command)
    def steer(tab: AnyTab, *arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
        if not tab.access.watching:
            return command(tab, *arguments, **named)
        tab.tell(words.ONLY_WATCHING, "hint")
        return cast(Result, _nothing() if iscoroutinefunction(command) else None)

    return steer


async def _nothing() -> None:
    """Do nothing, as an awaitable command."""
