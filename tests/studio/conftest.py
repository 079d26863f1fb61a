"""Sessions without a page: questions come out of a queue, so that nobody waits longer than they have to."""

import queue
from concurrent.futures import ThreadPoolExecutor

import pytest

import envs
from jmorl.storage.resume import Continued
from jmorl.storage.run_folder import RunFolder
from jmorl.studio.session import Session
from tests.registered import ThreeWays
from tests.studio.browsing import chromium

PATIENCE = 120  # seconds until a test fails that waits in vain


class Watched(Session):
    """A session that notes what is asked, and whose work in the background can be waited for."""

    def __init__(self):
        self.background = ThreadPoolExecutor(1)
        super().__init__(background=self.background)
        self.asked = queue.Queue()

    def ask(self, question):
        super().ask(question)
        self.asked.put(question)

    def question(self):
        return self.asked.get(timeout=PATIENCE)

    def ended(self):
        """Wait until the run has ended, or was left."""
        assert self.wait(PATIENCE)

    def thought(self):
        """Wait until all prospects are known."""
        self.background.submit(lambda: None).result(PATIENCE)


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def small(small_config, tmp_path_factory):
    """Return the settings of a short run: three generations of an environment that any process knows by its module."""
    config = tmp_path_factory.mktemp("config") / "config.toml"
    config.write_text(small_config.replace(env=f"tests.registered:{ThreeWays.id}").to_toml())
    return "--config", config


@pytest.fixture(scope="session")
def person_config(small_config):
    return small_config.replace(user="terminal")


@pytest.fixture
def make_session():
    """Make sessions that are closed after the test, whatever came of them."""
    made = []

    def make():
        made.append(Watched())
        return made[-1]

    yield make
    for session in made:
        session.close()


@pytest.fixture
def session(person_config, make_session, tmp_path):
    """Begin a run with a person as its user; it is in its warm-up."""
    session = make_session()
    folder = RunFolder.create(tmp_path / "run", person_config, envs.make(person_config.env))
    session.drive(Continued(folder, None))
    return session
