"""The server of the studio: its pages, and the files that they ask for."""

import asyncio
import logging
import platform
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import quote, urlencode, urlsplit

import jax
from fastapi import HTTPException, Request
from fastapi.responses import FileResponse, JSONResponse, RedirectResponse, Response
from nicegui import app, ui

from envs.drawing import NoDrawing
from jmorl.evaluation import score_blend
from jmorl.playback import record
from jmorl.report.journey import journey_page
from jmorl.report.plots import draw_run
from jmorl.storage.layout import Layout
from jmorl.storage.policy_file import StoredPolicy, load_policy, write_stored_policy
from jmorl.storage.stored_run import read_run
from jmorl.studio.access import Access
from jmorl.studio.between import blended
from jmorl.studio.episodes import episode_json
from jmorl.studio.guard import WATCH, Guard
from jmorl.studio.home import Home
from jmorl.studio.home_page import HomePage
from jmorl.studio.page import Page
from jmorl.studio.panels.introduction import REMEMBERED
from jmorl.studio.panels.lost import SWITCHED_OFF
from jmorl.studio.session import Session

ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 16 16"><path d="M2 3a11 11 0 0 1 11 11" fill="none" '
    'stroke="#0072B2" stroke-width="2.5"/><circle cx="10" cy="6.5" r="2.6" fill="#E69F00"/></svg>'
)
ENGLISH = '<script>document.documentElement.lang = "en";</script>'
DIAL_STEPS = 300  # of an episode, that are shown of a blend or an early agent: nobody waits for more
RECORDING = threading.Lock()
KEPT = "private, max-age=86400"  # an episode never changes


def check_address(host: str, port: int) -> None:
    """Raise OSError, saying what to do, if nobody can listen there."""
    try:
        with socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET):
            pass
    except OSError as error:
        raise OSError(f"cannot listen on {host}, port {port}: {error.strerror}; choose another --port") from error


def address(host: str, port: int, token: str | None) -> str:
    """Return the address to open in a browser."""
    name = platform.node() if host in ("0.0.0.0", "::") else f"[{host}]" if ":" in host else host
    return f"http://{name}:{port}/" + (f"?{urlencode({'token': token})}" if token else "")


def watch_address(steering: str, token: str) -> str:
    """Return the address to watch at, of a studio with a page for steering at the address `steering`."""
    parts = urlsplit(steering)
    return f"{parts.scheme}://{parts.netloc}{WATCH}/?{urlencode({'token': token})}"


def serve(session: Session, host: str, port: int, token: str | None, watch_token: str | None = None) -> None:
    """Serve the pages, in a thread of its own, until something is raised here: signals are for the caller to hear.

    `token` and `watch_token` are those of `Guard`.
    """
    app.config.quasar_config["loadingBar"]["skipHijack"] = True  # a bar at the top, without a name for who hears it
    app.add_middleware(Guard, host=host, token=token, watch_token=watch_token)
    logging.getLogger("uvicorn.error").addFilter(is_trouble)
    _add_pages(session, Home(session.runs), bool(token), watch_token)
    _add_files(session)

    serving = threading.Thread(target=_run, args=(host, port), name="server", daemon=True)
    serving.start()
    try:
        serving.join()
    finally:
        if app.is_started:
            app.shutdown()
            serving.join()


def _add_pages(session: Session, home: Home, guarded: bool, watch_token: str | None) -> None:
    """Serve the page of the open run at `/`, and the home page at `/runs`, where `/` leads while no run is open.

    The guard has them below its doors: each page may do what its own address allows.
    """

    def access(request: Request) -> Access:
        if request.scope["watching"]:
            return Access(watching=True)
        return Access(link=watch_address(str(request.url), watch_token) if watch_token else "", guarded=guarded)

    @ui.page("/")
    async def run_page(request: Request) -> Response | None:
        if not session.is_open:
            return RedirectResponse(f"{request.scope['root_path']}/runs")
        if await _connected():
            Page(session, app.storage.tab, access(request))
        return None

    @ui.page("/runs")
    async def home_page(request: Request) -> None:
        if await _connected():
            HomePage(session, home, app.storage.tab, access(request))


async def _connected() -> bool:
    """Wait until the browser's tab is known. Return whether it is still there then."""
    ui.add_head_html(f"{ENGLISH}{REMEMBERED}{SWITCHED_OFF}")
    client = ui.context.client
    await client.connected()
    return client.has_socket_connection


def is_trouble(record: logging.LogRecord) -> bool:
    """Return whether a record belongs in the server's log: requests broken off when the server ends do not."""
    broken_off = record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError)
    return not broken_off and "graceful shutdown exceeded" not in record.getMessage()


def _run(host: str, port: int) -> None:
    ui.run(
        host=host,
        port=port,
        title="jmorl studio",
        favicon=ICON,
        show=False,
        reload=False,
        tailwind=False,
        show_welcome_message=False,
        timeout_graceful_shutdown=1,
    )


def _add_files(session: Session) -> None:
    """Serve what the page asks for beside itself. Runs are named by ids, policies by numbers: no path is taken."""

    @app.get("/episodes/{run}/{policy}")
    def episode(run: str, policy: int) -> JSONResponse:
        with _not_there():
            return JSONResponse(_episode(_file(session, run, policy)), headers={"cache-control": KEPT})

    @app.get("/early/{run}/{policy}")
    def early_episode(run: str, policy: int) -> JSONResponse:
        agent = session.early_policy(run, policy)
        if agent is None:
            raise HTTPException(404, "the warm-up is over")
        with _not_there():
            return JSONResponse(_recorded(agent, DIAL_STEPS))

    @app.get("/between/{run}/{first}/{second}/{per_cent}.npz")
    def blend_file(run: str, first: int, second: int, per_cent: int) -> Response:
        with _not_there(), TemporaryDirectory() as folder:
            target = Path(folder) / "blend.npz"
            write_stored_policy(target, score_blend(blended(*session.files_of_pair(run, first, second), per_cent)))
            name = f'attachment; filename="blend-{first}-{second}-{per_cent}.npz"'
            headers = {"content-disposition": name}
            return Response(target.read_bytes(), media_type="application/octet-stream", headers=headers)

    @app.get("/between/{run}/{first}/{second}/{per_cent}")
    def blend_episode(run: str, first: int, second: int, per_cent: int) -> JSONResponse:
        with _not_there():
            policy = blended(*session.files_of_pair(run, first, second), per_cent)
            return JSONResponse(_recorded(policy, DIAL_STEPS), headers={"cache-control": KEPT})

    @app.get("/policies/{run}/{policy}.npz")
    def policy_file(run: str, policy: int) -> FileResponse:
        path = _file(session, run, policy)
        return FileResponse(path, media_type="application/octet-stream", filename=f"policy-{policy}.npz")

    @app.get("/fronts/{run}.csv")
    def front(run: str) -> FileResponse:
        path = Layout(_folder(session, run)).front
        return FileResponse(path, media_type="text/csv", filename=f"front-{path.parent.name}.csv")

    @app.get("/journeys/{run}.html")
    def journey(run: str) -> Response:
        folder = _folder(session, run)
        with _not_there():
            stored = read_run(folder)
            page = journey_page(stored, draw_run(stored, Layout(folder).plots))
        name = f"attachment; filename*=UTF-8''{quote(f'journey-{folder.name}.html')}"
        return Response(page, media_type="text/html", headers={"content-disposition": name})

    @app.get("/pictures/{run}.png")
    def picture(run: str) -> FileResponse:
        folder = _folder(session, run)
        with _not_there():
            drawn = draw_run(read_run(folder), Layout(folder).plots)
        return FileResponse(drawn[0], media_type="image/png", filename=f"front-{folder.name}.png")


def _folder(session: Session, run: str) -> Path:
    folder = session.folder(run)
    if folder is None or not Layout(folder).front.is_file():
        raise HTTPException(404, "there is no such run, or it has no front yet")
    return folder


def _file(session: Session, run: str, policy: int) -> Path:
    path = session.policy_file(run, policy)
    if path is None:
        raise HTTPException(404, f"there is no policy {policy} in this run")
    return path


@contextmanager
def _not_there() -> Iterator[None]:
    """Turn what cannot be given into an answer that says why."""
    try:
        yield
    except (NoDrawing, ValueError, OSError) as error:
        raise HTTPException(404, str(error)) from error


@lru_cache(maxsize=32)
def _episode(path: Path) -> dict[str, Any]:
    return _recorded(load_policy(path))


def _recorded(policy: StoredPolicy, most_steps: int | None = None) -> dict[str, Any]:
    """Record an episode from the first of `jmorl evaluate`'s starts: one at a time, so that all use one program."""
    with RECORDING:
        return episode_json(record(policy, jax.random.split(jax.random.key(0), 1)[0], most_steps))
