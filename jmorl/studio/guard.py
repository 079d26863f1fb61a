"""The guard of the studio: only its own pages pass, under its own names, with the token where there is one.

Pages, files, HTTP polling and web sockets all pass here before anything else sees them, by one of two doors. The path
of the address alone says which. What begins with `/watch/` is for watching, and takes the token for that. Everything
else is for steering, and takes the token for steering, if there is one. Behind both is the same application. The scope
tells it what its own addresses begin with (`root_path`), and whether the page that it makes may only watch
(`watching`).

A page has its right from the request that it was made for, and nothing that the browser says later changes that. A
reload, a link of the page, and its address without the query all lead through the same door again. Each door has a
cookie of its own, and browsers do not even send the one for watching to the other door. So a browser that knows both
addresses steers at the one and watches at the other. Where steering takes no token, as on this machine alone, anybody
who reaches the server can steer at the plain address.
"""

import ipaddress
import platform
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any, Literal
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE, WATCH_COOKIE = "jmorl_studio", "jmorl_studio_watch"
WATCH = "/watch"  # that all addresses for watching begin with
POLICY_VIOLATION = 1008  # closes a web socket
HEADERS = (  # nobody frames the page, and no file is taken for something else
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
)


def is_loopback(host: str) -> bool:
    """Return whether a server that listens on `host` can only be reached from this machine."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@dataclass(frozen=True)
class Door:
    """A way to the application: the addresses that begin with `root`, and the token that they take."""

    root: str
    cookie: str
    token: str | None
    same_site: Literal["strict", "lax"]

    def is_token(self, given: str) -> bool:
        """Return whether this is the token."""
        return self.token is not None and secrets.compare_digest(given.encode(), self.token.encode())

    def welcome(self, scope: Scope) -> Response:
        """Give a cookie to a request with the token in its address, and take it out of there; refuse any other."""
        query = parse_qsl(scope.get("query_string", b"").decode("latin-1"))
        if scope["type"] == "http" and any(name == "token" and self.is_token(value) for name, value in query):
            rest = urlencode([(name, value) for name, value in query if name != "token"])
            welcome = RedirectResponse(f"{self.root}/" + (f"?{rest}" if rest else ""), 303)
            assert self.token
            welcome.set_cookie(self.cookie, self.token, path=self.root or "/", httponly=True, samesite=self.same_site)
            return welcome
        return PlainTextResponse("Open the address with the token that `jmorl studio` has printed.", 401)


class Guard:
    """An ASGI application around `app`, for a server that listens on `host`.

    `token` is for steering, which takes none if it is None. `watch_token` is for watching, which nobody can do if it is
    None. The application may rely on `watching` in the scope of every request and web socket.
    """

    def __init__(self, app: ASGIApp, host: str, token: str | None, watch_token: str | None = None):
        self.app = app
        self.names = {"localhost"} if is_loopback(host) else {"localhost", host.lower(), platform.node().lower()}
        # A link to watch is followed from messages, too: a strict cookie would not come with that.
        self.watching = Door(WATCH, WATCH_COOKIE, watch_token, "lax")
        self.steering = Door("", COOKIE, token, "strict")

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Apply the network."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        watching = f"{scope['path']}/".startswith(f"{WATCH}/")
        door = self.watching if watching else self.steering
        refusal = self._refusal(door, scope, headers)
        if refusal is None:
            await self.app({**scope, "watching": watching, "root_path": door.root}, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": POLICY_VIOLATION})
        else:
            await refusal(scope, receive, send)

    def _refusal(self, door: Door, scope: Scope, headers: Mapping[str, str]) -> Response | None:
        """Return the answer to a request that may not pass the door; None if it may."""
        if not self._is_own_name(headers.get("host", "")):
            return PlainTextResponse("This server is not known under that name.", 421)
        if not _is_own_page(headers):
            return PlainTextResponse("Requests from other pages are refused.", 403)
        open_to_all = door is self.steering and door.token is None
        return None if open_to_all or _has_token(door, headers) else door.welcome(scope)

    def _is_own_name(self, host: str) -> bool:
        """Return whether the host is an address or one of our names: any other name can be rebound to this machine."""
        name = urlsplit(f"//{host}").hostname or ""
        try:
            return bool(ipaddress.ip_address(name))
        except ValueError:
            return name in self.names


def _has_token(door: Door, headers: Mapping[str, str]) -> bool:
    """Return whether the browser has been given the cookie of the door."""
    try:
        cookie = SimpleCookie(headers.get("cookie", "")).get(door.cookie)
    except CookieError:
        return False
    return cookie is not None and door.is_token(cookie.value)


def _is_own_page(headers: Mapping[str, str]) -> bool:
    """Return whether one of our pages asks, or somebody follows a link; programs other than browsers do not say."""
    origin, site = headers.get("origin"), headers.get("sec-fetch-site", "none")
    if origin is not None:
        return urlsplit(origin).netloc == headers.get("host")
    return site in ("none", "same-origin") or headers.get("sec-fetch-mode") == "navigate"


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> Any:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message["headers"], *HEADERS]}
        await send(message)

    return sending
