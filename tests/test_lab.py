"""The laboratory: states, answers, the page's messages, the server, and the page in a browser."""

from __future__ import annotations

import asyncio
import contextlib
import http.client
import io
import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from dataclasses import asdict, replace

import numpy as np
import psutil
import pytest
from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

import fingerpad as fp
from fingerpad.experiments.requests.touch import ReductionRequest
from fingerpad.lab.answer import Answer, LabState, compared, state_of
from fingerpad.lab.laboratory import Laboratory, Making, shipped
from fingerpad.lab.server import HOST, reply_to, serve, spec_of
from fingerpad.lab.static import write_static
from fingerpad.lab.view import view_of
from fingerpad.reduction.model import write_reduced

RANGE = "object: {kind: sphere, curvature_per_m: %g}\nrange: {depth_mm: 0.5, x_mm: [-1, 1]}\ncalibration: 0\n"
PRESS = LabState("ball", depth_mm=0.4)


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    """Two objects: a ball, and one that presses a fifth harder everywhere."""
    folder = tmp_path_factory.mktemp("lab")
    for name, curvature in (("ball", 287.0), ("flat", 180.0)):
        (folder / f"{name}.yaml").write_text(RANGE % curvature, encoding="utf-8")
    made = Laboratory(folder / "kept", [folder / "ball.yaml", folder / "flat.yaml"])
    made.answer(PRESS)
    model = made.model(PRESS)
    assert model is not None
    harder = replace(model, totals=1.2 * model.totals, coefficients=1.2 * model.coefficients)
    write_reduced(harder, made.path(replace(PRESS, object="flat")))
    return made


def until(is_done):
    end = time.monotonic() + 60.0
    while not is_done():
        assert time.monotonic() < end
        time.sleep(0.02)


def waited(laboratory, state, exact=False):
    """View of a state once its presses are done."""
    views = []
    until(lambda: views.append(view_of(laboratory, state, exact)) or not isinstance(views[-1], Making))
    return views[-1]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (None, "must be a mapping of keys to values: got None"),
        ({}, "LabState needs object: it is not given"),
        ({"object": "ball", "depht_mm": 1}, "did you mean depth_mm"),
        ({"object": "ball", "depth_mm": "deep"}, "depth_mm must be a finite number [mm]: got 'deep'"),
        ({"object": "ball", "depth_mm": float("nan")}, "depth_mm must be a finite number"),
        ({"object": "ball", "x_mm": 1e9}, "x_mm must lie within -20 to 20 mm"),
        ({"object": "ball", "x_mm": [1]}, "x_mm must be a finite number"),
        ({"object": "ball", "hold_ms": True}, "hold_ms must be a finite number"),
        ({"object": "ball", "afferent": "RB"}, "afferent must be one of SAI, RA, PC, SAII, range: got 'RB'"),
    ],
)
def test_a_wrong_state_is_one_sentence(asked, said):
    with pytest.raises(fp.InputError, match=re.escape(said)):
        state_of(asked)
    assert state_of({name: str(value) for name, value in asdict(PRESS).items()}) == PRESS


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ("nonsense", "must have the key state"),
        ({"id": 3}, "must have the key state"),
        ({"id": 3, "state": {"object": "cube"}}, "object must be one of ball, flat: got 'cube'"),
        ({"id": 3, "state": {"object": "ball", "depth_mm": 2}}, "depth_mm must be at most 0.5"),
        ({"id": 3, "state": {"object": "ball", "depth_mm": 0.4, "x_mm": 2}}, "x_mm must lie within -1 to 1"),
        ({"id": 3, "state": {"object": "ball", "tissues": "wood"}}, "tissues must be one of human"),
        ({"id": 3, "state": {"object": "ball", "finger": "thumb"}}, "finger must be one of adult"),
    ],
)
def test_a_broken_message_is_one_sentence(laboratory, message, said):
    reply = reply_to(laboratory, message)
    assert said in reply["error"]
    assert reply["id"] == (message["id"] if isinstance(message, dict) else None)
    json.dumps(reply)


def test_a_defect_is_told_and_does_not_stop(laboratory, monkeypatch, caplog):
    monkeypatch.setattr(laboratory, "poll", lambda state: 1 / 0)
    reply = reply_to(laboratory, {"id": 1, "state": {"object": "ball"}})
    assert "the terminal says why" in reply["error"]
    assert "ZeroDivisionError" in caplog.text


def test_the_page_gets_all_that_it_draws(laboratory):
    reply = json.loads(json.dumps(reply_to(laboratory, {"id": 7, "state": asdict(PRESS)})))
    view, shown = reply["view"], reply["view"]["answer"]
    n, points = len(shown["times_ms"]), len(view["x_mm"]) * len(view["z_mm"])
    assert reply["id"] == 7
    assert len(shown["force_mn"]) == len(shown["contact_mm"]) == n
    assert len(shown["frames"]) == 4 * -(-n * points // 3)
    assert len(shown["spikes"]) == len(view["positions_mm"]) == len(view["order"])
    assert 0.0 == shown["force_mn"][0] < max(shown["force_mn"])
    assert sum(map(len, shown["spikes"])) > 50
    area = np.pi * shown["contact_mm"][n // 2][2] * shown["contact_mm"][n // 2][3]
    assert area == pytest.approx(shown["area_mm2"][n // 2], rel=0.01)
    assert spec_of(laboratory)["objects"]["ball"]["depth_mm"] == [0.05, 0.5]


def test_a_deeper_press_is_stronger_and_another_afferent_is_silent_in_the_hold(laboratory):
    light, deep = (laboratory.answer(replace(PRESS, depth_mm=depth)) for depth in (0.2, 0.5))
    assert deep.force_mn.max() > 2.0 * light.force_mn.max()
    rapid = laboratory.answer(replace(PRESS, afferent="RA")).response
    assert rapid.dynamic_rate_hz.max() > 20.0
    assert rapid.static_rate_hz.max() < 0.1 * rapid.dynamic_rate_hz.max()
    assert deep.response.static_rate_hz.max() > rapid.static_rate_hz.max()


def test_the_full_solution_stands_beside_the_reduced_one(laboratory):
    assert isinstance(view_of(laboratory, PRESS, exact=True), Making)
    view = waited(laboratory, PRESS, exact=True)
    assert view.exact is not None
    assert "Largest differences from the full solution: force" in view.difference
    forces = np.interp(view.exact.times_ms, view.answer.times_ms, view.answer.force_mn)
    assert np.abs(forces - view.exact.force_mn).max() < 0.02 * max(view.exact.force_mn)


def test_the_full_solution_is_shown_until_there_is_a_reduced_touch(laboratory, monkeypatch):
    exact, model, go_on = laboratory.answer(PRESS, exact=True), laboratory.model(PRESS), threading.Event()
    monkeypatch.setattr(ReductionRequest, "run", lambda *_: go_on.wait(60.0) and model)
    source = laboratory.source(PRESS).with_name("first.yaml")
    source.write_text(RANGE % 287.0, encoding="utf-8")
    begun, state = Laboratory(laboratory.folder, [source]), replace(PRESS, object="first")
    view = waited(begun, state)
    assert view.making is not None
    assert view.making.what == "a reduced touch of first"
    np.testing.assert_allclose(view.answer.force_mn, exact.force_mn, atol=1e-3)
    go_on.set()
    until(lambda: begun.making(state) is None)
    assert waited(begun, state).making is None
    with pytest.raises(fp.InputError, match="x_mm must lie within -1 to 1"):
        Laboratory(laboratory.folder / "none", [source]).answer(replace(state, x_mm=2.0), exact=True)


def test_observers_tell_what_differs(laboratory):
    ball, flat = (laboratory.answer(replace(PRESS, object=name)) for name in ("ball", "flat"))
    assert (compared(ball, ball).ideal, compared(ball, ball).summed) == (0.5, 0.5)
    found = compared(ball, flat)
    assert 0.5 < found.summed <= found.ideal <= 1.0
    assert f"ball from flat in {found.ideal:.0%}" in waited(laboratory, replace(PRESS, other="flat")).compared


def test_the_python_lines_reproduce_the_view(laboratory):
    view = waited(laboratory, PRESS)
    printed, names = io.StringIO(), {}
    with contextlib.redirect_stdout(printed):
        exec(view.python, names)
    np.testing.assert_allclose(names["answer"].force_mn, view.answer.force_mn, atol=1e-3)
    for own, train in zip(names["spikes_ms"], view.answer.spikes, strict=True):
        np.testing.assert_allclose(own, train, atol=0.01)
    assert sum(map(len, names["spikes_ms"])) > 50


def test_what_was_made_is_not_pressed_again(laboratory, monkeypatch):
    again = Laboratory(laboratory.folder, [laboratory.source(LabState(name)) for name in laboratory.names])
    monkeypatch.setattr(ReductionRequest, "run", None)
    kept, known = again.answer(PRESS), laboratory.answer(PRESS)
    assert isinstance(kept, Answer)
    assert (kept.force_mn == known.force_mn).all()
    assert again.path(replace(PRESS, finger="child")) != again.path(PRESS)
    assert again.model(replace(PRESS, tissues="paper")) is None


@pytest.mark.parametrize("kept", [False, True], ids=["asked meanwhile", "answered before"])
def test_errors_are_measured_while_the_answer_is_there(laboratory, monkeypatch, kept):
    asked = []

    def run(described, runner):
        asked.append(described.calibration)
        return model if asked[-1] == 0 else replace(model, error=np.full_like(model.error, 0.02))

    model = laboratory.model(PRESS)
    assert model is not None
    source = laboratory.source(PRESS).with_name("measured.yaml")
    source.write_text((RANGE % 287.0).replace("calibration: 0", "calibration: 20"), encoding="utf-8")
    monkeypatch.setattr(ReductionRequest, "run", run)
    measuring = Laboratory(laboratory.folder, [source])
    state = replace(PRESS, object="measured")
    measuring.path(state).unlink(missing_ok=True)
    if kept:
        measuring.answer(state)
    first = waited(measuring, state)
    until(lambda: measuring.measured(state))
    assert asked == [0, 20]
    assert max(first.answer.error_mn) == 0.0 < max(waited(measuring, state).answer.error_mn)


def test_a_thin_plate_from_a_file_can_be_pressed(tmp_path):
    """It ended in a traceback: the skin was behind the plate where its first touch was sought."""
    corners = [f"v {x} {y} {z}" for x in (-2, 2) for y in (-1, 0) for z in (-2, 2)]
    faces = ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
    (tmp_path / "plate.obj").write_text("\n".join([*corners, *faces]), encoding="utf-8")
    asked = "object: {kind: surface, path: plate.obj, up: +y}\nrange: {depth_mm: 1, tilt_deg: [-10, 10]}\n"
    (tmp_path / "plate.yaml").write_text(asked, encoding="utf-8")
    training = Laboratory(tmp_path / "kept", [tmp_path / "plate.yaml"]).described(LabState("plate")).training
    edge_mm = 2.0 * np.tan(np.deg2rad(10.0))
    assert [-edge_mm < pose.first_touch_mm <= 0.0 for pose in training.poses()] == [True] * 3


def test_a_laboratory_that_is_refused_leaves_no_folder(tmp_path):
    assert Laboratory(tmp_path).names == tuple(path.stem for path in shipped())
    with pytest.raises(fp.InputError, match="different names"):
        Laboratory(tmp_path, [shipped()[0], shipped()[0]])
    folder = tmp_path / "lab"
    command = [sys.executable, "-m", "fingerpad", "lab", str(tmp_path / "none.yaml"), "--folder", str(folder)]
    refused = subprocess.run(command, capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert "none.yaml" in refused.stderr
    assert not folder.exists()


@pytest.fixture(scope="module")
def served(laboratory):
    """Start the command, and give the address of the page."""
    files = [str(laboratory.source(LabState(name))) for name in laboratory.names]
    command = [sys.executable, "-m", "fingerpad", "lab", *files, "--folder", str(laboratory.folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line.startswith("Open: http://127.0.0.1:"), line
        yield line.split()[1], process
        process.send_signal(signal.SIGINT)
        assert process.wait(10) == 130
        assert "Traceback" not in process.stdout.read()


def test_the_server_listens_on_loopback_alone_and_survives_users(served):
    address, process = served
    connections = psutil.Process(process.pid).net_connections()
    assert {each.laddr.ip for each in connections if each.status == "LISTEN"} == {"127.0.0.1"}

    async def use():
        first, second = await session(address), await session(address)
        await first.write_message("no message of the protocol")
        second.stream.close()  # as if the browser was killed
        third = await session(address)
        for each in (first, second, third):
            each.close()
            while await each.read_message() is not None:
                pass
            each.stream.close()  # else it may outlive the loop that would close it

    asyncio.run(use())
    with urllib.request.urlopen(address) as page:
        assert page.status == 200


def test_a_port_that_cannot_be_is_one_sentence(laboratory):
    with socket.socket() as held:
        held.bind((HOST, 0))
        held.listen()
        for port in (held.getsockname()[1], 70000):
            with pytest.raises(fp.InputError, match=f"--port must be a free port: got {port}"):
                serve(laboratory, port)


@pytest.mark.parametrize(
    ("changes", "status"),
    [
        ({}, 400),
        ({"Sec-WebSocket-Protocol": "bokeh"}, 400),
        ({"Sec-WebSocket-Protocol": "bokeh, a.b"}, 400),
        ({"Sec-WebSocket-Protocol": "bokeh, eyJzZXNzaW9uX2lkIjogIngiLCAic2Vzc2lvbl9leHBpcnkiOiAxfQ"}, 400),
        ({"Origin": "http://[::1"}, 400),
        ({"Origin": "http://elsewhere.org"}, 403),
    ],
    ids=["none", "no token", "no JSON", "expired", "broken origin", "another origin"],
)
def test_a_wrong_header_of_a_websocket_is_refused(served, changes, status):
    connection = http.client.HTTPConnection(served[0][len("http://") : -1])
    connection.request("GET", "/ws", headers={
        "Origin": served[0][:-1], "Connection": "Upgrade", "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "x" * 22 + "==",
    } | changes)  # fmt: skip
    with connection.getresponse() as answer:
        assert answer.status == status
    connection.close()


async def session(address):
    """Open a session as a browser does, and wait for the first word of the server."""
    with urllib.request.urlopen(address) as page:
        token = re.search(r'"token":"([^"]+)"', page.read().decode())[1]
    wanted = HTTPRequest(address.replace("http", "ws") + "ws", headers={"Origin": address[:-1]})
    opened = await websocket_connect(wanted, subprotocols=["bokeh", token])
    assert "ACK" in str(await opened.read_message())
    return opened


def test_the_static_page_holds_its_answers(laboratory, tmp_path):
    written = write_static(laboratory, tmp_path)
    assert written == tmp_path / "index.html"
    assert written.stat().st_size < 5e6
    assert str(laboratory.folder) not in written.read_text("utf-8")


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(
    BROWSER is None, reason="no Chromium is installed (apt-get install chromium)"
)


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        opened = play.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield opened
        opened.close()


class Watched:
    """A page of the laboratory, and what went wrong in it."""

    def __init__(self, browser, address, width=1280):
        self.page = browser.new_page(viewport={"width": width, "height": 800})
        self.wrong: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda said: said.type == "error" and self.wrong.append(said.text))
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(address)
        self.page.locator(".lab div[role=status] p").first.wait_for(timeout=60000)

    @property
    def words(self):
        return str(self.page.locator(".lab div[role=status]").inner_text())

    @property
    def said(self):
        return str(self.page.locator(".lab .said").inner_text())

    def changes(self, action, of):
        """Do something, and wait until what is shown differs."""
        before, end = of(), time.monotonic() + 20.0
        action()
        while of() == before:
            assert time.monotonic() < end, f"still {before!r}"
            self.page.wait_for_timeout(20)
        return of()

    def picture(self, number=0):
        return str(self.page.locator(".lab canvas").nth(number).evaluate("canvas => canvas.toDataURL()"))


@needs_browser
def test_the_page_works_with_keys_and_mouse(browser, served, tmp_path):
    address = served[0]
    watched = Watched(browser, f"{address}#depth_mm=0.3")
    page = watched.page
    assert page.locator("input[name=depth_mm]").input_value() == "0.3"
    skin = watched.picture()
    page.locator("input[name=depth_mm]").focus()
    watched.changes(lambda: page.keyboard.press("ArrowRight"), lambda: watched.words)
    assert watched.picture() != skin
    page.wait_for_url("**depth_mm=0.35**")
    canvas = page.locator(".lab canvas").first
    watched.changes(lambda: (canvas.focus(), page.keyboard.press("PageDown")), lambda: watched.words)
    canvas.hover()
    watched.changes(lambda: page.mouse.wheel(0, 100), lambda: watched.words)
    page.wait_for_url("**depth_mm=0.35**")
    watched.changes(lambda: page.locator("input[name=time]").press("ArrowLeft"), lambda: watched.words)
    number = page.locator("input[name=depth_mm_number]")
    said = watched.changes(lambda: (number.fill("3"), number.press("Enter")), lambda: watched.said)
    assert "depth_mm must be at most 0.5" in said
    watched.changes(lambda: (number.fill("0.4"), number.press("Enter")), lambda: watched.said)
    watched.changes(lambda: page.locator("select[name=other]").select_option("flat"), lambda: watched.words)
    assert "An ideal observer tells ball from flat" in watched.words
    page.get_by_role("button", name="Solve exactly").click()
    page.get_by_text("Largest differences from the full solution").wait_for(timeout=60000)
    for name in ("touch.png", "touch.json", "touch.py"):
        text = {"touch.png": "Save figure", "touch.json": "Save data", "touch.py": "Save Python"}[name]
        with page.expect_download() as saved:
            page.get_by_role("button", name=text).click()
        saved.value.save_as(tmp_path / name)
        assert saved.value.suggested_filename == name
    assert (tmp_path / "touch.png").read_bytes().startswith(b"\x89PNG")
    assert max(json.loads((tmp_path / "touch.json").read_text())["answer"]["force_mn"]) > 1.0
    assert watched.wrong == []
    assert all(url.startswith((address, "data:", "blob:")) for url in watched.asked)
    page.close()


@needs_browser
def test_the_mouse_drags_the_object_over_the_skin(browser, served):
    small = Watched(browser, served[0], width=360)
    assert small.page.evaluate("document.documentElement.scrollWidth") <= 360  # it scrolls only downwards
    small.page.close()
    watched = Watched(browser, f"{served[0]}#depth_mm=0.4")
    page, along = watched.page, watched.page.locator("input[name=x_mm]")
    box = page.locator(".lab canvas").first.bounding_box()
    assert box is not None
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(*middle)
    page.mouse.down()
    seen = []
    for part in range(1, 6):  # each way is answered while the button is down
        watched.changes(lambda part=part: page.mouse.move(middle[0] + 8 * part, middle[1]), watched.picture)
        seen.append(float(along.input_value()))
    page.mouse.up()
    assert seen == sorted(seen)
    assert 0.3 < seen[-1] <= 1.0
    page.mouse.move(*middle)  # without a button nothing moves
    assert float(along.input_value()) == seen[-1]
    page.mouse.click(box["x"] + 2, middle[1])  # beyond the range the object stays at its end
    page.wait_for_url("**x_mm=-1**")
    page.wait_for_timeout(200)
    assert float(along.input_value()) == -1.0
    assert watched.wrong == []
    page.close()


@needs_browser
def test_the_static_page_works_from_a_file(browser, laboratory, tmp_path):
    watched = Watched(browser, write_static(laboratory, tmp_path).as_uri())
    page = watched.page
    skin = watched.picture()
    watched.changes(lambda: page.locator("input[name=depth_mm]").press("ArrowRight"), lambda: watched.words)
    assert watched.picture() != skin
    watched.changes(lambda: page.locator("select[name=other]").select_option("flat"), lambda: watched.words)
    assert "An ideal observer tells ball from flat" in watched.words
    assert watched.wrong == []
    assert all(url.startswith(("file:", "data:", "blob:")) for url in watched.asked)
    page.close()


OWN = """
from dataclasses import dataclass

import numpy as np

import fingerpad as fp


@dataclass(frozen=True)
class Onset:
    threshold_kpa: float = 0.5
    dynamic_quantity: str = "stored"
    static_quantity: str = "compressive_stress"
    rate_measure: str = "count"

    def spikes(self, sed):
        above = [np.flatnonzero(course > self.threshold_kpa)[:1] for course in sed.values.T]
        return fp.SpikeTrains.from_lists([sed.times_ms[first] for first in above])


own = Onset()
"""


def test_all_types_a_mixed_range_and_an_own_afferent_respond(laboratory):
    """Each is streamed from one reduced touch, which depends on what afferents follow alone."""
    for name in ("PC", "SAII"):
        found = laboratory.answer(replace(PRESS, afferent=name, depth_mm=0.5)).response
        assert found.dynamic_rate_hz.shape == (len(found.positions_mm),)
        assert np.isfinite(found.first_spike_latency_ms).any(), name
    folder = laboratory.source(PRESS).parent
    (folder / "mine_in_lab.py").write_text(OWN, encoding="utf-8")
    for name, afferents in (
        ("mixed", "densities_per_cm2: {RA: 100, PC: 20, SAII: 30}"),
        ("own", "afferent: 'mine_in_lab:own'"),
    ):
        text = RANGE % 287.0 + f"afferents: {{{afferents}}}\n"
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    state = LabState("mixed", depth_mm=0.4, afferent="range")
    with pytest.raises(fp.InputError, match="allow it by --allow-python"):
        Laboratory(laboratory.folder, [folder / "own.yaml"])
    several = Laboratory(laboratory.folder, [folder / "mixed.yaml", folder / "own.yaml"], allow_python=True)
    model = laboratory.model(PRESS)
    write_reduced(model, several.path(state))
    write_reduced(model, several.path(replace(state, object="own")))
    mixed = several.answer(state).response
    assert list(mixed.parts) == ["RA", "PC", "SAII"]
    assert (
        sum(map(len, mixed["RA"].spikes))
        == laboratory.answer(replace(PRESS, afferent="RA")).response.spike_count.sum()
    )
    view, printed, names = waited(several, replace(state, object="own")), io.StringIO(), {}
    with contextlib.redirect_stdout(printed):
        exec(view.python, names)
    assert [train.tolist() for train in names["spikes_ms"]] == [
        pytest.approx(each, abs=0.01) for each in view.answer.spikes
    ]
    assert {len(train) for train in view.answer.spikes} == {0, 1}
