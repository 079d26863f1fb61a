"""`python -m tests.breaking_off N FOLDER ARGUMENTS...`: the command line, killed at the N-th thing it does to a folder.

Opening, renaming, deleting and making files and folders count. With N = 0 nobody is killed, and the number is printed.
"""

import os
import signal
import sys
from pathlib import Path


class Killer:
    """An audit hook: Python reports to it whatever is done to files."""

    EVENTS = ("open", "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate")

    def __init__(self, last: int, folder: Path):
        self.last, self.folder, self.count = last, str(folder), 0

    def __call__(self, event: str, arguments: tuple) -> None:
        if event in self.EVENTS and str(arguments[0]).startswith(self.folder):
            self.count += 1
            if self.count == self.last:
                os.kill(os.getpid(), signal.SIGKILL)


def main() -> int:
    killer = Killer(int(sys.argv[1]), Path(sys.argv[2]))
    from jmorl.cli import main

    sys.argv = ["jmorl", *sys.argv[3:]]
    sys.addaudithook(killer)
    code = main()
    print(killer.count)
    return code


if __name__ == "__main__":
    sys.exit(main())
