"""The page and its files: what a browser is sent, and what it may do with it."""

import re

import pytest
from starlette.testclient import TestClient

from tauscope.server.page.router import MEDIA_TYPES, PLOT_LIBRARY, STATIC


def directives(policy: str) -> dict[str, list[str]]:
    return {words[0]: words[1:] for words in (part.split() for part in policy.split(";")) if words}


@pytest.fixture
def client(module_client: TestClient) -> TestClient:
    return module_client


def test_the_page_comes_with_a_policy_that_runs_nothing_but_its_own_files(client: TestClient) -> None:
    answer = client.get("/")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    policy = directives(answer.headers["content-security-policy"])
    assert policy["default-src"] == ["'none'"]
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == ["'self'"]
    assert policy["frame-ancestors"] == policy["base-uri"] == ["'none'"]
    assert "unsafe" not in answer.headers["content-security-policy"]


def test_the_page_has_no_inline_script_or_style_and_no_foreign_address(client: TestClient) -> None:
    page = client.get("/").text
    assert re.findall(r"<script(?![^>]*\bsrc=)", page) == []
    assert re.findall(r"<style|\sstyle=|\son[a-z]+=", page) == []
    for name in [path.name for path in STATIC.iterdir()]:
        text = client.get(f"/page/{name}").text
        assert set(re.findall(r"https?://[^\s\"'`]+", text)) <= {"http://www.w3.org/2000/svg"}, name
        assert not re.search(r"innerHTML|outerHTML|insertAdjacent|document\.write|\beval\(|new Function", text), name


def test_every_file_that_the_page_names_is_there(client: TestClient) -> None:
    named = set(re.findall(r"/page/([\w.-]+)", client.get("/").text))
    for script in [path for path in STATIC.iterdir() if path.suffix == ".js"]:
        named |= set(re.findall(r'from "\./([\w.-]+)"', script.read_text(encoding="utf-8")))
    assert named >= {"main.js", "style.css", *PLOT_LIBRARY}
    for name in named:
        answer = client.get(f"/page/{name}")
        assert answer.status_code == 200, name
        assert answer.headers["content-type"] == MEDIA_TYPES["." + name.rsplit(".", 1)[1]]


def test_what_the_browser_has_is_not_sent_again(client: TestClient) -> None:
    first = client.get("/page/main.js")
    again = client.get("/page/main.js", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert client.get("/page/main.js", headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize("name", ["nothing.js", "..%2Frouter.py", "%2e%2e%2f%2e%2e%2fapp.py", "router.py"])
def test_no_other_file_is_sent(client: TestClient, name: str) -> None:
    answer = client.get(f"/page/{name}")
    assert answer.status_code == 404
    assert answer.json()["code"] == "not-found"
