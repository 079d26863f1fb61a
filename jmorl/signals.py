"""SIGINT and SIGTERM: the first asks a run to end in good order, a second ends the process at once."""

import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import Any, Self

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupted(KeyboardInterrupt):
    """A signal asked the program to end. `exit_code` is what shells give for it: 130 or 143."""

    def __init__(self, number: int):
        self.number = number
        super().__init__(f"{signal.Signals(number).name} received")

    @property
    def exit_code(self) -> int:
        """What shells give for the signal: 130 or 143."""
        return 128 + self.number


class StopSignals:
    """Within the block a signal is noted, and raised as Interrupted where it does no harm.

    That is in `check` and in `interruptible`.

    A compiled call cannot be broken off, and Python runs its own handlers only after it. So a thread reads the signals
    as they come: it says what will happen, and at the second ends the process there and then. For the main thread.
    """

    def __init__(self, says: str = "stopping after this round; once more to stop at once, without it"):
        self.says = says
        self.received: int | None = None
        self._at_once = False
        self._raised = False

    def __enter__(self) -> Self:
        self._read_end, self._write_end = socket.socketpair()  # a pipe would not do on every system
        self._write_end.setblocking(False)
        self._wakeup = signal.set_wakeup_fd(self._write_end.fileno())
        # What is ignored, as in a background job of a shell script, is to stay so.
        heard = [each for each in SIGNALS if signal.getsignal(each) is not signal.SIG_IGN]
        self._handlers: dict[signal.Signals, Any] = {each: signal.signal(each, self._handle) for each in heard}
        self._thread = threading.Thread(target=self._watch, name="signals", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        for each, handler in self._handlers.items():
            signal.signal(each, handler)
        signal.set_wakeup_fd(self._wakeup)
        self._write_end.close()  # which ends the thread
        self._thread.join()
        self._read_end.close()

    def check(self) -> None:
        """Raise Interrupted if a signal has come."""
        if self.received is not None:
            raise Interrupted(self.received)

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Within the block a signal is raised at once: while somebody is asked, or nothing but thought is lost."""
        self._at_once = True
        try:
            self.check()
            yield
        finally:
            self._at_once = False

    def _handle(self, number: int, frame: FrameType | None) -> None:
        self.received = number
        if self._at_once:
            self._raised = True  # before the block is left: the thread may look only then
            raise Interrupted(number)

    def _watch(self) -> None:
        came = 0
        while numbers := self._read_end.recv(1):
            if numbers[0] not in SIGNALS:
                continue
            came += 1
            if came > 1:
                os._exit(128 + numbers[0])
            if not self._at_once and not self._raised:
                print(f"jmorl: {self.says}", file=sys.stderr, flush=True)
