"""The workspace on Weights & Biases, saved through its own client to a server on this machine."""

import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest
import wandb

from forestrl.jobs.dashboard import EPISODE, SECTIONS, workspace
from tests.commands import forestrl
from tests.docs.pages import ROOT, explained_metrics


def test_panels_name_only_metrics_that_exist():
    """The page of metrics is tested to be what a training logs."""
    shown = {curve for plots in SECTIONS.values() for curves in plots.values() for curve in curves}
    assert shown <= explained_metrics()
    assert f'"{EPISODE}"' in (ROOT / "forestrl/jobs/train.py").read_text()


def test_a_metric_has_one_panel():
    curves = [each for plots in SECTIONS.values() for curves in plots.values() for each in curves]
    assert len(curves) == len(set(curves)) > 25


def test_the_workspace_holds_every_panel_over_frames():
    sections = spec(workspace("me", "forests", "all")._to_model().spec.model_dump(by_alias=True))
    assert [section["name"] for section in sections] == list(SECTIONS)
    for section, plots in zip(sections, SECTIONS.values(), strict=True):
        lines = [p["config"] for p in section["panels"] if p["viewType"] == "Run History Line Plot"]
        drawn = {each["chartTitle"]: (each["xAxis"], tuple(each["metrics"])) for each in lines}
        assert drawn == {heading: ("frames", curves) for heading, curves in plots.items()}
    (media,) = [p for p in sections[0]["panels"] if p["viewType"] == "Media Browser"]
    assert media["config"]["mediaKeys"] == [EPISODE]


def spec(view):
    return view["section"]["panelBankConfig"]["sections"]


class Dashboard(BaseHTTPRequestHandler):
    """Answers as the service does, and keeps what it was asked to save."""

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        asked = json.loads(body) if self.path == "/graphql" else {"query": ""}
        if "upsertView" in asked["query"]:
            self.server.saved.append(asked["variables"])
            if self.server.refuses:
                return self.answer({"errors": [{"message": "permission denied"}]})
            view = {"id": "1", "name": "nw-abc-v"}
            return self.answer({"data": {"upsertView": {"view": view, "inserted": True}}})
        viewer = {"id": "1", "entity": "me", "username": "me", "flags": "{}"}
        return self.answer({"data": {"viewer": viewer | {"teams": {"edges": []}}}})

    def answer(self, thing):
        body = json.dumps(thing).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *arguments): ...


@pytest.fixture
def service(monkeypatch, tmp_path):
    server = ThreadingHTTPServer(("127.0.0.1", 0), Dashboard)
    server.saved, server.refuses = [], False
    threading.Thread(target=server.serve_forever, daemon=True).start()
    monkeypatch.setenv("WANDB_BASE_URL", f"http://127.0.0.1:{server.server_port}")
    monkeypatch.setenv("WANDB_API_KEY", "0" * 40)
    monkeypatch.chdir(tmp_path)
    wandb.teardown()  # what it remembers of other servers
    yield server
    wandb.teardown()
    server.shutdown()


def test_the_command_saves_the_workspace_and_says_where_it_is(service):
    result = forestrl("dashboard", "project=forests", "title=all of them")
    assert result.status == 0, result.err
    assert result.out == f"http://127.0.0.1:{service.server_port}/me/forests?nw=abc\n"
    (view,) = service.saved
    named = [view[key] for key in ("entityName", "projectName", "displayName")]
    assert named == ["me", "forests", "all of them"]
    assert [section["name"] for section in spec(json.loads(view["spec"]))] == list(SECTIONS)


def test_a_refusal_is_one_line(service):
    service.refuses = True
    result = forestrl("dashboard", "entity=others")
    assert result.status == 1
    (line,) = [line for line in result.err.splitlines() if line.startswith("forestrl")]
    assert "did not take the workspace" in line and "permission denied" in line


def test_nobody_logged_in_is_one_line(service, monkeypatch, tmp_path):
    monkeypatch.delenv("WANDB_API_KEY")
    monkeypatch.setenv("NETRC", str(tmp_path / "none"))
    result = forestrl("dashboard")
    assert (result.status, service.saved) == (1, [])
    assert result.err == (
        "forestrl dashboard: nobody is logged in: run `wandb login`, or set WANDB_API_KEY\n"
    )
