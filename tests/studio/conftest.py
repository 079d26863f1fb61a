"""Sessions without a page: questions come out of a queue, so that nobody waits longer than they have to."""

import queue

import pytest

import envs
from jmorl.storage.resume import Continued
from jmorl.storage.run_folder import RunFolder
from jmorl.studio.session import Session

PATIENCE = 120  # seconds until a test fails that waits in vain


class Watched(Session):
    """A session that notes what is asked, and computes prospects at once."""

    def __init__(self):
        super().__init__()
        self.asked = queue.Queue()

    def _asked(self, question):
        super()._asked(question)
        self.asked.put(question)

    def question(self):
        return self.asked.get(timeout=PATIENCE)

    def ended(self):
        """Wait until the run has ended, or was left."""
        self._thread.join(PATIENCE)
        assert not self._thread.is_alive()

    def thought(self):
        """Wait until all prospects are known."""
        self._thinking.submit(lambda: None).result(PATIENCE)


@pytest.fixture(scope="session")
def person_config(small_config):
    return small_config.replace(user="terminal")


@pytest.fixture
def make_session():
    """Sessions that are closed after the test, whatever came of them."""
    made = []

    def make():
        made.append(Watched())
        return made[-1]

    yield make
    for session in made:
        session.close()


@pytest.fixture
def session(person_config, make_session, tmp_path):
    """A new run with a person as its user, in its warm-up."""
    session = make_session()
    folder = RunFolder.create(tmp_path / "run", person_config, envs.make(person_config.env))
    session.drive(Continued(folder, None))
    return session
