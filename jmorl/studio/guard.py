"""The guard of the studio: only its own pages pass, under its own names, with the token where there is one.

There is one door for everything: pages, files, HTTP polling and web sockets pass here before anything else sees them.
"""

import ipaddress
import platform
import secrets
from collections.abc import Mapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, urlencode, urlsplit

from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE = "jmorl_studio"
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


class Guard:
    """An ASGI application around `app`, for a server that listens on `host` and asks for `token`, if there is one."""

    def __init__(self, app: ASGIApp, host: str, token: str | None):
        self.app = app
        self.names = {"localhost"} if is_loopback(host) else {"localhost", host.lower(), platform.node().lower()}
        self.token = token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Apply the network."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope, headers)
        if refusal is None:
            await self.app(scope, receive, _with_headers(send))
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": POLICY_VIOLATION})
        else:
            await refusal(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Mapping[str, str]) -> Response | None:
        """Return the answer to a request that may not pass; None if it may."""
        if not self._is_own_name(headers.get("host", "")):
            return PlainTextResponse("This server is not known under that name.", 421)
        if not _is_own_page(headers):
            return PlainTextResponse("Requests from other pages are refused.", 403)
        if self.token and not self._has_token(headers):
            return self._welcome(scope)
        return None

    def _is_own_name(self, host: str) -> bool:
        """Return whether the host is an address or one of our names: any other name can be rebound to this machine."""
        name = urlsplit(f"//{host}").hostname or ""
        try:
            return bool(ipaddress.ip_address(name))
        except ValueError:
            return name in self.names

    def _has_token(self, headers: Mapping[str, str]) -> bool:
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
        except CookieError:
            return False
        return cookie is not None and self._is_token(cookie.value)

    def _welcome(self, scope: Scope) -> Response:
        """Give a cookie to a request with the token in its address, and take it out of there; refuse any other."""
        query = parse_qsl(scope.get("query_string", b"").decode("latin-1"))
        if scope["type"] == "http" and any(name == "token" and self._is_token(value) for name, value in query):
            rest = urlencode([(name, value) for name, value in query if name != "token"])
            welcome = RedirectResponse("/" + (f"?{rest}" if rest else ""), 303)
            assert self.token
            welcome.set_cookie(COOKIE, self.token, httponly=True, samesite="strict")
            return welcome
        return PlainTextResponse("Open the address with the token that `jmorl studio` has printed.", 401)

    def _is_token(self, given: str) -> bool:
        assert self.token
        return secrets.compare_digest(given.encode(), self.token.encode())


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
