"""The command `jmorl studio` in a process of its own."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx

PATIENCE = 400  # seconds


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class Served:
    """A studio that is being served; leaving the block ends it."""

    def __init__(self, *arguments, port=None, host="127.0.0.1", command=("jmorl.cli", "studio")):
        self.port = port or free_port()
        self.log = []  # what it prints
        command = [sys.executable, "-m", *command, *map(str, arguments)]
        self.process = subprocess.Popen(
            [*command, "--port", str(self.port), "--host", host],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=Path(__file__).parent.parent.parent,
            # NiceGUI behaves otherwise in its own tests, which it takes these for.
            env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST")},
        )

    @property
    def address(self):
        return f"http://127.0.0.1:{self.port}"

    def __enter__(self):
        for line in self.process.stdout:
            self.log.append(line)
            if line.startswith("The studio is at"):
                return self.answering()
        self.__exit__()
        raise AssertionError("the studio did not start:\n" + "".join(self.log))

    def __exit__(self, *error):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
        finally:
            self.log.extend(self.process.stdout)
            self.process.stdout.close()

    def answering(self):
        """Wait until the server has its port."""
        patience = time.monotonic() + PATIENCE
        while time.monotonic() < patience and self.process.poll() is None:
            try:
                httpx.get(self.address, timeout=5)
                return self
            except httpx.TransportError:
                time.sleep(0.05)
        self.__exit__()
        raise AssertionError("the studio does not answer:\n" + "".join(self.log))

    def kill(self):
        """Kill the server, as the operating system does when memory runs out."""
        self.process.kill()
        self.process.wait(60)
