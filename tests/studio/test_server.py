"""The server as a whole, without a browser: who is let in at every door, and what can be read through them."""

import asyncio
import io
import json
import logging
import shutil
from urllib.parse import quote

import httpx
import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from jmorl.cli import main
from jmorl.storage.manifest import read_manifest
from jmorl.storage.policy_file import load_policy
from jmorl.storage.stored_run import read_run
from jmorl.studio.server import is_trouble
from tests.registered import ThreeWays
from tests.resuming import train
from tests.studio.serving import Served, free_port

SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport="
NAME = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def runs(small_config, tmp_path_factory):
    """Make a finished run in a folder whose name is markup, with a secret beside it."""
    place = tmp_path_factory.mktemp("studio")
    train(place / NAME, small_config.replace(env=f"tests.registered:{ThreeWays.id}"))
    (place / "secret.npz").write_text("secret")
    return place


@pytest.fixture(scope="module")
def studio(runs):
    with Served(runs / NAME) as served:
        yield served


@pytest.fixture(scope="module")
def guarded(runs):
    """Serve on all addresses of this machine, with a token."""
    shutil.copytree(runs / NAME, runs / "other")
    with Served(runs / "other", "--token", "sesame", "--watch-token", "peek", host="0.0.0.0") as served:
        yield served


@pytest.fixture(scope="module")
def chosen(runs):
    return json.loads((runs / NAME / "result.json").read_text())["chosen"]["policy"]


def run_of(runs):
    return read_manifest(runs / NAME)["run"]


def is_open(served, origin, cookie=None, root=""):
    """Return whether the server opens its web socket, or that below `root`, to a page of this origin."""
    url = f"ws://127.0.0.1:{served.port}{root}{SOCKET}websocket"
    try:
        with connect(url, origin=origin, additional_headers={"Cookie": cookie} if cookie else None) as socket:
            return socket.recv(timeout=10).startswith("0{")  # Engine.IO's greeting
    except InvalidStatus as refusal:
        assert refusal.response.status_code == 403
        return False


def test_the_page_is_there_and_the_name_of_a_run_is_no_markup(studio):
    page = httpx.get(studio.address)
    assert page.status_code == 200 and "jmorl studio" in page.text
    assert "<img src=x" not in page.text
    assert page.headers["x-frame-options"] == "DENY"


def test_sockets_open_to_our_own_page_alone(studio):
    assert is_open(studio, studio.address)
    assert not is_open(studio, "http://evil.example")
    assert not is_open(studio, f"http://127.0.0.1:{studio.port + 1}")
    polling = studio.address + SOCKET + "polling"
    assert httpx.get(polling, headers={"origin": studio.address}).status_code == 200
    foreign = httpx.get(polling, headers={"origin": "http://evil.example"})
    assert foreign.status_code == 403 and "access-control-allow-origin" not in foreign.headers


def test_a_name_that_is_rebound_to_this_machine_is_refused(studio):
    assert httpx.get(studio.address, headers={"host": f"evil.example:{studio.port}"}).status_code == 421


def test_the_policy_file_is_served_whole(studio, runs, chosen):
    answer = httpx.get(f"{studio.address}/policies/{run_of(runs)}/{chosen}.npz")
    assert answer.content == (runs / NAME / "chosen.npz").read_bytes()
    assert "attachment" in answer.headers["content-disposition"]
    assert json.loads(str(np.load(io.BytesIO(answer.content))["header"]))["id"] == chosen


@pytest.mark.parametrize(
    ("address", "kind", "start"),
    [
        ("/fronts/{}.csv", "text/csv", b"policy,"),
        ("/pictures/{}.png", "image/png", b"\x89PNG"),
        ("/journeys/{}.html", "text/html", b"<!doctype html>"),
    ],
)
def test_what_is_saved_of_a_run_is_named_after_its_folder_whatever_that_is_called(studio, runs, address, kind, start):
    answer = httpx.get(studio.address + address.format(run_of(runs)))
    assert answer.headers["content-type"].startswith(kind) and answer.content.startswith(start)
    assert quote(NAME) in answer.headers["content-disposition"] and NAME.encode() not in answer.content


@pytest.fixture(scope="module")
def pair(runs):
    """Two policies of the front."""
    first, second, *_ = [policy.id for policy in read_run(runs / NAME).front]
    return first, second


def test_a_blend_is_served_as_a_file_with_a_score_of_its_own(studio, runs, pair):
    answer = httpx.get(f"{studio.address}/between/{run_of(runs)}/{pair[0]}/{pair[1]}/25.npz", timeout=60)
    assert f"blend-{pair[0]}-{pair[1]}-25.npz" in answer.headers["content-disposition"]
    file = runs / "blend.npz"
    file.write_bytes(answer.content)
    policy = load_policy(file)
    shares = dict(zip(pair, (0.75, 0.25), strict=True))
    assert policy.header["blend"] == {"parents": sorted(pair), "coefficients": [shares[each] for each in sorted(pair)]}
    assert policy.header["evaluation_episodes"] == 100 and np.isfinite(policy.header["values"]).all()


def test_what_is_no_blend_is_refused_with_a_reason(studio, runs, pair):
    address = f"{studio.address}/between/{run_of(runs)}"
    for path, reason in (
        (f"{pair[0]}/{pair[1]}/151", "from -50 to 150 % of the way"),
        (f"{pair[0]}/99999/50", "there is no file of policy 99999"),
        (f"{pair[0]}/{pair[1]}/50", "drawing"),  # the environment has none
    ):
        answer = httpx.get(f"{address}/{path}", timeout=60)
        assert answer.status_code == 404 and reason in answer.json()["detail"]


@pytest.mark.parametrize(
    "path",
    [
        "/between/RUN/..%2F..%2Fsecret/1/50.npz",
        "/between/another/0/1/50.npz",
        "/policies/../secret.npz",
        "/policies/..%2F..%2Fsecret/1.npz",
        "/policies/RUN/..%2F..%2Fsecret.npz",
        "/policies/RUN/../../secret.npz",
        "/policies/RUN/-1.npz",
        "/policies/RUN/99999.npz",
        "/policies/another/1.npz",
        "/fronts/another.csv",
        "/pictures/another.png",
        "/journeys/..%2Fsecret.html",
        "/episodes/RUN/..%2F..%2Fmanifest.json",
        "/episodes/../1",
        "/manifest.json",
        "/config.toml",
        "/%2e%2e/secret.npz",
        "//etc/passwd",
    ],
)
def test_nothing_else_can_be_read(studio, runs, path):
    answer = httpx.get(studio.address + path.replace("RUN", run_of(runs)))
    assert answer.status_code in (404, 422)
    assert "secret" not in answer.text.replace("/secret", "") and "root:" not in answer.text


def test_an_environment_without_a_drawing_has_no_playback(studio, runs, chosen):
    answer = httpx.get(f"{studio.address}/episodes/{run_of(runs)}/{chosen}")
    assert answer.status_code == 404 and "has no drawing" in answer.json()["detail"]


def test_beyond_this_machine_every_door_asks_for_the_token(guarded, runs, chosen):
    run = read_manifest(runs / "other")["run"]
    doors = ["/", f"/policies/{run}/{chosen}.npz", f"/episodes/{run}/{chosen}", SOCKET + "polling", "/favicon.ico"]
    for door in doors:
        assert httpx.get(guarded.address + door).status_code == 401, door
    assert not is_open(guarded, guarded.address)
    assert not is_open(guarded, guarded.address, "jmorl_studio=guess")
    with httpx.Client(follow_redirects=True) as browser:
        assert browser.get(guarded.address + "/?token=guess").status_code == 401
        page = browser.get(guarded.address + "/?token=sesame")
        assert page.status_code == 200 and "token" not in str(page.url)
        for door in doors[1:2]:
            assert browser.get(guarded.address + door).status_code == 200
    assert is_open(guarded, guarded.address, "jmorl_studio=sesame")
    assert not is_open(guarded, "http://evil.example", "jmorl_studio=sesame")


def test_the_address_is_printed_with_the_token(guarded, studio):
    assert f":{guarded.port}/?token=sesame" in guarded.log[-1] and "token" not in studio.log[-1]


def test_who_watches_is_served_below_watch_and_nowhere_else(guarded, runs, chosen):
    run = read_manifest(runs / "other")["run"]
    doors = ["/", "/runs", f"/policies/{run}/{chosen}.npz", f"/journeys/{run}.html", SOCKET + "polling"]
    with httpx.Client(follow_redirects=True) as browser:
        assert browser.get(guarded.address + "/watch/?token=sesame").status_code == 401
        page = browser.get(guarded.address + "/watch?token=peek")
        assert page.status_code == 200 and str(page.url) == guarded.address + "/watch/"
        assert '"/_nicegui' not in page.text and "/watch/_nicegui" in page.text  # what it asks for is behind its door
        for door in doors:
            assert browser.get(f"{guarded.address}/watch{door}").status_code == 200, door
            for other in (door, f"/watch/..{door}", f"/watch/%2e%2e{door}", f"/watch//{door}"):
                answer = browser.get(guarded.address + other)
                assert answer.status_code in (401, 404), other
    watches = "jmorl_studio_watch=peek"
    assert is_open(guarded, guarded.address, watches, "/watch")
    assert not is_open(guarded, guarded.address, watches)
    assert not is_open(guarded, guarded.address, "jmorl_studio=peek")
    assert not is_open(guarded, "http://evil.example", watches, "/watch")


def test_who_watches_must_not_have_the_token_that_steers(runs, capsys):
    assert main(["studio", str(runs), "--token", "same", "--watch-token", "same", "--port", str(free_port())]) != 0
    assert "--watch-token must not be --token" in capsys.readouterr().err


def test_over_a_folder_of_runs_nothing_is_open_and_every_door_leads_home(runs, chosen):
    with Served(runs, "--token", "sesame", "--watch-token", "peek", host="0.0.0.0") as served:
        for door in ("/", "/runs"):
            assert httpx.get(served.address + door).status_code == 401
        with httpx.Client(follow_redirects=True) as browser:
            home = browser.get(served.address + "/?token=sesame")
            assert home.url.path == "/runs" and home.status_code == 200 and "<img src=x" not in home.text
            for path in (
                f"/policies/{run_of(runs)}/{chosen}.npz",
                f"/episodes/{run_of(runs)}/{chosen}",
                "/fronts/x.csv",
            ):
                assert browser.get(served.address + path).status_code == 404  # of no open run's history
            watched = browser.get(served.address + "/watch/?token=peek")
            assert watched.url.path == "/watch/runs" and watched.status_code == 200
    assert any(line.startswith("Others can watch") and "/watch/?token=peek" in line for line in served.log)


def test_the_home_page_is_there_beside_an_open_run(studio):
    assert httpx.get(studio.address + "/runs").status_code == 200


def test_a_port_that_is_taken_is_said_before_anything_is_made(studio, tmp_path, capsys):
    arguments = ["studio", "--port", str(studio.port), "--out", str(tmp_path / "run")]
    assert main(arguments) == 1
    assert f"cannot listen on 127.0.0.1, port {studio.port}" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("message", "error", "shown"),
    [
        ("Exception in ASGI application", ValueError("broken"), True),
        ("Exception in ASGI application", asyncio.CancelledError("Task cancelled"), False),
        ("Cancel 1 running task(s), timeout graceful shutdown exceeded", None, False),
        ("Invalid HTTP request received.", None, True),
    ],
)
def test_what_the_end_of_the_server_breaks_off_is_no_trouble(message, error, shown):
    info = (type(error), error, None) if error else None
    assert is_trouble(logging.LogRecord("uvicorn.error", logging.ERROR, "", 0, message, (), info)) == shown
