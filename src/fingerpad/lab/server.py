"""The page on this computer, served by Panel: one message asks, one answers."""

from __future__ import annotations

import json
import logging
import signal
import socket
import time
from collections.abc import Callable
from dataclasses import asdict
from importlib import resources
from typing import Any
from urllib.parse import urlsplit

from fingerpad.core.errors import FingerpadError, InputError
from fingerpad.core.units import unit_of
from fingerpad.geometry.fingertip import FINGERS
from fingerpad.lab.answer import AFFERENTS, BOUNDS, LabState, state_of
from fingerpad.lab.laboratory import Laboratory, Making
from fingerpad.lab.view import view_of
from fingerpad.mechanics.tissues import TISSUES

LOGGER = logging.getLogger(__name__)
HOST = "127.0.0.1"

CONTROLS = (
    ("object", "object", 0),
    ("size", "size", 1),
    ("depth_mm", "depth", 0.05),
    ("x_mm", "along the finger", 0.1),
    ("z_mm", "across the finger", 0.1),
    ("tilt_deg", "tilt", 1),
    ("slide_mm", "slide in the hold", 0.1),
    ("ramp_ms", "press and lift", 10),
    ("hold_ms", "hold", 10),
    ("other", "compared with", 0),
    ("other_size", "other size", 1),
    ("afferent", "afferents", 0),
    ("finger", "finger", 0),
    ("tissues", "tissues", 0),
)
"""What can be set: name, label and step."""


def spec_of(laboratory: Laboratory) -> dict[str, object]:
    trained = {name: laboratory.described(LabState(name)).training for name in laboratory.names}
    sizes, objects = {}, {}
    for name, training in trained.items():
        range_ = training.range
        way = range_.x_mm[1] - range_.x_mm[0]
        sizes[name] = getattr(training.touch.indenter, range_.parameter) if range_.parameter else 0
        objects[name] = {
            "depth_mm": [BOUNDS["depth_mm"][0], range_.depth_mm],
            "x_mm": range_.x_mm,
            "z_mm": range_.z_mm,
            "tilt_deg": range_.tilt_deg,
            "slide_mm": [-way, way],
            "parameter": range_.parameter,
            "values": range_.values or [0, 0],
            "size": sizes[name],
        }
    first = laboratory.names[0]
    depth = min(LabState.depth_mm, trained[first].range.depth_mm)
    return {
        "controls": [(name, label, unit_of(name), step) for name, label, step in CONTROLS],
        "objects": objects,
        "bounds": BOUNDS,
        "choices": {
            "object": laboratory.names,
            "other": ["", *laboratory.names],
            "afferent": AFFERENTS,
            "finger": ["", *FINGERS],
            "tissues": ["", *TISSUES],
        },
        "empty": {"other": "nothing", "finger": "as in the file", "tissues": "as in the file"},
        "start": asdict(LabState(first, size=sizes[first], depth_mm=depth)),
        "exact": True,
    }


def reply_to(laboratory: Laboratory, message: Any) -> dict[str, object]:
    """Answer one message of the page; whatever it is, an error is one sentence."""
    asked = message if isinstance(message, dict) else {}
    reply: dict[str, object] = {"id": asked.get("id")}
    try:
        if "state" not in asked:
            raise InputError("A message to the laboratory must have the key state.")
        made = view_of(laboratory, state_of(asked["state"]), bool(asked.get("exact")))
        reply["making" if isinstance(made, Making) else "view"] = asdict(made)
    except FingerpadError as error:
        reply["error"] = str(error)
    except Exception:
        LOGGER.exception("The laboratory could not answer %.200r", message)
        reply["error"] = "The laboratory could not answer this; the terminal says why."
    return reply


def require_panel() -> None:
    """Raise `InputError` if Panel is not installed."""
    try:
        import panel.custom  # noqa: F401
    except ImportError as error:
        raise InputError("The laboratory needs Panel: pip install 'fingerpad[lab]'.") from error


def serve(laboratory: Laboratory, port: int = 0, ready: Callable[[str], None] = print) -> None:
    """Serve the page on the loopback interface until the process is interrupted."""
    require_panel()
    from panel.custom import JSComponent
    from panel.io.server import get_server
    from param import String
    from tornado.websocket import WebSocketClosedError, WebSocketHandler

    class Page(JSComponent):
        spec = String(json.dumps(spec_of(laboratory)))
        _esm = (resources.files("fingerpad.lab") / "page.js").read_text("utf-8")

        def _handle_msg(self, message: Any) -> None:
            self._send_msg(json.dumps(reply_to(laboratory, message)))

    interrupted, port = signal.getsignal(signal.SIGINT), _free_port(port)
    server = get_server(
        lambda: Page(sizing_mode="stretch_width"),
        port=port,
        address=HOST,
        websocket_origin=[f"{HOST}:{port}", f"localhost:{port}"],
        title="fingerpad laboratory",
        check_unused_sessions_milliseconds=5000,
        unused_session_lifetime_milliseconds=15000,
    )
    for rule in server._tornado.wildcard_router.rules:
        if issubclass(rule.target, WebSocketHandler):
            rule.target = _refusing(rule.target)

    def report(loop: Any, context: dict[str, Any]) -> None:
        # A browser may leave while its answer is on the way.
        if not isinstance(context.get("exception"), WebSocketClosedError):
            loop.default_exception_handler(context)

    server.io_loop.asyncio_loop.set_exception_handler(report)  # type: ignore[attr-defined]
    # Panel would end without a word after Ctrl-C.
    signal.signal(signal.SIGINT, interrupted)
    ready(f"http://{HOST}:{port}/")
    try:
        server.io_loop.start()
    finally:
        laboratory.close()


def _refusing(handler: type[Any]) -> type[Any]:
    """Make a handler of websockets that answers 400 to headers from which the given one opens no session."""
    from bokeh.util.token import get_token_payload
    from tornado.web import HTTPError

    class Refusing(handler):
        async def prepare(self) -> None:
            try:
                urlsplit(self.request.headers.get("Origin", ""))
            except ValueError as error:
                raise HTTPError(400) from error
            await super().prepare()

        def select_subprotocol(self, offered: list[str]) -> str:
            try:
                name, token = offered
                opens = name == "bokeh" and get_token_payload(token)["session_expiry"] > time.time()
            except Exception as error:  # whatever a token that the page did not get makes its decoder raise
                raise HTTPError(400) from error
            if not opens:
                raise HTTPError(400)
            return str(super().select_subprotocol(offered))

    return Refusing


def _free_port(port: int) -> int:
    """Return a port if it is free, any free one for 0."""
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            tried.bind((HOST, port))
        except (OSError, OverflowError) as error:
            raise InputError("--port", "must be a free port", f"{port} ({error})") from error
        return int(tried.getsockname()[1])
