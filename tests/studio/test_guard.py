"""Who may pass, header by header, and that nothing passes beside the guard."""

import asyncio

import httpx
import pytest

from jmorl.studio.guard import COOKIE, WATCH_COOKIE, Guard, is_loopback

HOST = "127.0.0.1:8080"


async def application(scope, receive, send):
    body = f"watching below {scope['root_path']}".encode() if scope["watching"] else b"inside"
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": body})


def ask(headers=None, path="/", host="127.0.0.1", token=None, watch_token=None):
    async def asking():
        transport = httpx.ASGITransport(Guard(application, host, token, watch_token))
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            return await client.get(path, headers=headers or {})

    return asyncio.run(asking())


def connect(headers, token=None, path="/", watch_token=None):
    """Return what a web socket is answered: "inside", "watching", or the code it is closed with."""
    answers = []

    async def inside(scope, receive, send):
        answers.append("watching" if scope["watching"] else "inside")

    async def receive():
        return {"type": "websocket.connect"}

    async def send(message):
        answers.append(message["code"])

    scope = {"type": "websocket", "headers": [(name.encode(), value.encode()) for name, value in headers.items()]}
    guard = Guard(inside, "127.0.0.1", token, watch_token)
    asyncio.run(guard({**scope, "path": path, "query_string": b""}, receive, send))
    return answers


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"origin": f"http://{HOST}"}, 200),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "http://127.0.0.1:9999"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": f"http://{HOST}.evil.example"}, 403),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, 403),
        ({"sec-fetch-site": "same-site", "sec-fetch-mode": "cors"}, 403),
        ({"sec-fetch-site": "same-origin", "sec-fetch-mode": "cors"}, 200),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, 200),
        ({"host": "evil.example:8080"}, 421),
        ({"host": "127.0.0.1.evil.example"}, 421),
        ({"host": ""}, 421),
        ({"host": "localhost:8080"}, 200),
        ({"host": "[::1]:8080"}, 200),
    ],
)
def test_a_request_passes_under_our_name_from_our_page_only(headers, status):
    assert ask(headers).status_code == status


@pytest.mark.parametrize(
    ("headers", "answer"),
    [
        ({"host": HOST, "origin": f"http://{HOST}"}, ["inside"]),
        ({"host": HOST, "origin": "http://evil.example"}, [1008]),
        ({"host": HOST, "origin": "null"}, [1008]),
        ({"host": "evil.example", "origin": "http://evil.example"}, [1008]),
    ],
)
def test_a_web_socket_passes_from_our_page_only(headers, answer):
    assert connect(headers) == answer


def test_without_the_token_nothing_is_served():
    for path in ("/", "/policies/run/1.npz", "/_nicegui/static/nicegui.js", "/_nicegui_ws/socket.io/"):
        assert ask(path=path, token="secret").status_code == 401
        assert ask({"cookie": f"{COOKIE}=wrong"}, path, token="secret").status_code == 401
        assert ask({"cookie": f"{COOKIE}=secret"}, path, token="secret").text == "inside"
    own = {"host": HOST, "origin": f"http://{HOST}"}
    assert connect(own, "secret") == [1008]
    assert connect({**own, "cookie": f"{COOKIE}=secret"}, "secret") == ["inside"]


def test_the_token_in_the_address_becomes_a_cookie_and_vanishes():
    answer = ask(path="/?token=secret&more=1", token="secret")
    assert answer.status_code == 303 and answer.headers["location"] == "/?more=1"
    cookie = answer.headers["set-cookie"].lower()
    assert f"{COOKIE}=secret" in cookie and "httponly" in cookie and "samesite=strict" in cookie
    assert ask(path="/?token=wrong", token="secret").status_code == 401
    assert ask(path="/?token=", token="secret").status_code == 401


def test_the_token_does_not_help_another_page():
    assert ask({"cookie": f"{COOKIE}=secret", "origin": "http://evil.example"}, token="secret").status_code == 403


DOORS = ("/", "/runs", "/policies/run/1.npz", "/_nicegui_ws/socket.io/")
WATCHES = {"cookie": f"{WATCH_COOKIE}=peek"}


@pytest.mark.parametrize("token", ["secret", None])
def test_the_token_for_watching_opens_what_is_below_watch_and_only_to_watch(token):
    for door in DOORS:
        answer = ask(WATCHES, f"/watch{door}", token=token, watch_token="peek")
        assert answer.text == "watching below /watch", door
        for headers in (None, {"cookie": f"{WATCH_COOKIE}=guess"}, {"cookie": f"{COOKIE}=peek"}):
            assert ask(headers, f"/watch{door}", token=token, watch_token="peek").status_code == 401, door
    own = {"host": HOST, "origin": f"http://{HOST}"}
    assert connect({**own, **WATCHES}, token, "/watch/_nicegui_ws/socket.io/", "peek") == ["watching"]
    assert connect(own, token, "/watch/_nicegui_ws/socket.io/", "peek") == [1008]


@pytest.mark.parametrize("cookie", [f"{WATCH_COOKIE}=peek", f"{COOKIE}=peek", f"{COOKIE}=", f"{WATCH_COOKIE}=secret"])
def test_the_token_for_watching_does_not_help_to_steer(cookie):
    for door in (*DOORS, "/?token=peek", "/watching", "/Watch/", "/runs/watch/", "//watch/"):
        assert ask({"cookie": cookie}, door, token="secret", watch_token="peek").status_code == 401, door
    own = {"host": HOST, "origin": f"http://{HOST}"}
    assert connect({**own, "cookie": cookie}, "secret", watch_token="peek") == [1008]


def test_a_browser_that_knows_both_addresses_steers_at_one_and_watches_at_the_other():
    both = {"cookie": f"{COOKIE}=secret; {WATCH_COOKIE}=peek"}
    assert ask(both, "/", token="secret", watch_token="peek").text == "inside"
    assert ask(both, "/watch/", token="secret", watch_token="peek").text == "watching below /watch"


def test_on_this_machine_the_plain_address_steers_whoever_watches():
    for door in DOORS:
        assert ask(WATCHES, door, watch_token="peek").text == "inside"


@pytest.mark.parametrize("path", ["/watch", "/watch/", "/watch/runs"])
def test_the_token_for_watching_becomes_a_cookie_for_those_addresses_alone(path):
    answer = ask(path=f"{path}?token=peek&more=1", token="secret", watch_token="peek")
    assert answer.status_code == 303 and answer.headers["location"] == "/watch/?more=1"
    cookie = answer.headers["set-cookie"].lower()
    assert f"{WATCH_COOKIE}=peek" in cookie and "path=/watch;" in cookie and "httponly" in cookie
    assert ask(path=f"{path}?token=secret", token="secret", watch_token="peek").status_code == 401


def test_without_a_token_for_watching_nobody_watches():
    for headers, path in ((None, "/watch/"), ({"cookie": f"{WATCH_COOKIE}="}, "/watch/"), (None, "/watch/?token=")):
        assert ask(headers, path).status_code == 401


def test_watching_takes_our_own_page_and_name_as_steering_does():
    assert ask({**WATCHES, "origin": "http://evil.example"}, "/watch/", watch_token="peek").status_code == 403
    assert ask({**WATCHES, "host": "evil.example"}, "/watch/", watch_token="peek").status_code == 421


def test_a_server_for_others_is_known_under_its_own_name_too():
    assert ask({"host": "studio.example:8080"}, host="studio.example", token=None).status_code == 200
    assert ask({"host": "other.example:8080"}, host="studio.example", token=None).status_code == 421


def test_nobody_frames_the_page():
    headers = ask().headers
    assert headers["x-frame-options"] == "DENY" and headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(
    ("host", "answer"),
    [("127.0.0.1", True), ("127.8.8.8", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("::", False)]
    + [("192.168.1.2", False), ("studio.example", False)],
)
def test_loopback_is_what_only_this_machine_reaches(host, answer):
    assert is_loopback(host) is answer
