"""The page of viser's client with a word ahead of it."""

from __future__ import annotations

import time
import urllib.request
from pathlib import Path

import pytest

viser = pytest.importorskip("viser")

from vgtsim.web.serving import make_client, open_client  # noqa: E402


def test_the_client_is_viser_s_with_scripts_ahead():
    client = (Path(viser.__file__).parent / "client" / "build" / "index.html").read_text(encoding="utf-8")
    page, cut = make_client(), client.index("<head>") + len("<head>")
    added = len(page) - len(client)
    assert page[:cut] + page[cut + added :] == client
    script = page[cut : cut + added].strip()
    assert script.startswith("<script>")
    assert script.endswith("</script>")
    assert "antialias: false" in script


def test_the_server_gives_it_and_another_server_gives_viser_s(tmp_path):
    ours, other = open_client("127.0.0.1", 0, "a label", tmp_path), viser.ViserServer("127.0.0.1", 0, verbose=False)
    found = []
    for server in (ours, other):
        with urllib.request.urlopen(f"http://127.0.0.1:{server.get_port()}/", timeout=600) as answer:
            found.append("antialias: false" in answer.read().decode())
        server.stop()
    assert found == [True, False]


def test_what_nobody_can_read_is_one_line_in_the_log(tmp_path, caplog):
    connect = pytest.importorskip("websockets.sync.client").connect
    server = open_client("127.0.0.1", 0, "a label", tmp_path)
    version = f"viser-v{viser.__version__}"
    with connect(f"ws://127.0.0.1:{server.get_port()}", subprotocols=[version], max_size=None) as line:
        line.send(b"no message")
        until = time.monotonic() + 600
        while not any("handler failed" in text for text in caplog.messages) and time.monotonic() < until:
            time.sleep(0.05)
    server.stop()
    (said,) = (record for record in caplog.records if "handler failed" in record.getMessage())
    assert said.exc_info is None
    assert said.getMessage().startswith("connection handler failed: ")
    assert "\n" not in said.getMessage()
