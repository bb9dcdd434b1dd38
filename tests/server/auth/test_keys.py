"""API keys as they are kept, and as a running service knows them."""

import hashlib
import json
import stat
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tauscope.errors import TauscopeError
from tauscope.server.auth.gate import MOST_CALLERS, RateLimit
from tauscope.server.auth.keys import KEY_FILE, LOCAL, Caller, KeyFile, KeyRing, Scope, match_key

NOW = datetime(2026, 11, 22, tzinfo=UTC)
DAY = timedelta(days=1)


def test_the_file_holds_a_salted_hash_and_only_its_owner_reads_it(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    (first, text), (second, other) = (file.add(name, Scope.MOVE, NOW, DAY) for name in ("ann", "bob"))
    content = (tmp_path / KEY_FILE).read_text()
    for key, whole in ((first, text), (second, other)):
        prefix, identifier, secret = whole.split("_", 2)
        assert (prefix, identifier) == ("tsk", key.id)
        assert len(secret) >= 43  # 256 bits
        assert secret not in content
        assert key.hash == hashlib.sha256(bytes.fromhex(key.salt) + secret.encode()).hexdigest()
    assert first.salt != second.salt
    assert stat.S_IMODE((tmp_path / KEY_FILE).stat().st_mode) == 0o600
    assert file.read() == (first, second)
    assert first.expires == NOW + DAY


def test_a_key_is_found_by_its_whole_text_only(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    key, text = file.add("ann", Scope.READ, NOW, None)
    other, _ = file.add("bob", Scope.READ, NOW, None)
    keys = file.read()
    assert match_key(keys, text) == key
    wrong = ["", "_", "__", text[:-1], text + "x", text.upper(), text.replace("tsk_", "tsx_"), f"tsk_{key.id}_",
             key.hash, text.replace(key.id, other.id), f"tsk_{key.id}_{key.hash}", "\ud800", "é" * 50]  # fmt: skip
    assert [match_key(keys, each) for each in wrong] == [None] * len(wrong)
    assert match_key((), text) is None


@pytest.mark.parametrize("name", ["", "  ", "a\nb", "x" * 101, "ann"])
def test_names_that_are_refused(name: str, tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    file.add("ann", Scope.READ, NOW, None)
    with pytest.raises(TauscopeError) as raised:
        file.add(name, Scope.READ, NOW, None)
    assert "\n" not in str(raised.value)
    assert len(file.read()) == 1


def test_a_revoked_key_stays_in_the_list_and_frees_its_name(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    key, _ = file.add("ann", Scope.READ, NOW, None)
    assert file.revoke(key.id, NOW).state(NOW) == "revoked"
    with pytest.raises(TauscopeError, match="revoked"):
        file.revoke("ann", NOW)
    file.add("ann", Scope.READ, NOW, None)
    assert [entry.state(NOW) for entry in file.read()] == ["revoked", "valid"]


def test_many_programs_at_once_lose_no_key(tmp_path: Path) -> None:
    def make(number: int) -> None:
        KeyFile(tmp_path).add(f"key {number}", Scope.READ, NOW, None)

    threads = [threading.Thread(target=make, args=(number,)) for number in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {key.name for key in KeyFile(tmp_path).read()} == {f"key {number}" for number in range(20)}


@pytest.mark.parametrize("content", [b"", b"{", b'{"keys": 1}', b'{"form": "tauscope.keys/2", "keys": []}', b"\xff"])
def test_a_damaged_file_is_refused_at_the_start_and_changes_nothing_later(content: bytes, tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    _, text = file.add("ann", Scope.READ, NOW, None)
    ring = KeyRing(file, is_required=False, clock=lambda: NOW)
    (tmp_path / KEY_FILE).write_bytes(content)
    with pytest.raises(TauscopeError, match="damaged"):
        KeyRing(file, is_required=False)
    ring.look()
    assert isinstance(ring.caller(text), Caller)


def test_a_service_without_keys_asks_for_none_until_it_has_one(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    ring = KeyRing(file, is_required=False, clock=lambda: NOW)
    assert ring.caller(None) == LOCAL
    _, text = file.add("ann", Scope.READ, NOW, None)
    ring.look()
    assert isinstance(ring.caller(None), str)
    assert ring.caller(text) == Caller("ann", text.split("_")[1], Scope.READ)
    file.revoke("ann", NOW)
    ring.look()
    assert isinstance(ring.caller(text), str)
    assert isinstance(ring.caller(None), str)


def test_keys_whose_file_was_taken_away_are_no_keys(tmp_path: Path) -> None:
    file = KeyFile(tmp_path)
    _, text = file.add("ann", Scope.READ, NOW, None)
    ring = KeyRing(file, is_required=False, clock=lambda: NOW)
    (tmp_path / KEY_FILE).unlink()
    ring.look()
    assert isinstance(ring.caller(text), str)
    assert isinstance(ring.caller(None), str)


def test_an_expired_key_stops_an_arm_and_nothing_else(tmp_path: Path) -> None:
    file, now = KeyFile(tmp_path), [NOW]
    _, text = file.add("ann", Scope.READ, NOW, DAY)
    ring = KeyRing(file, is_required=False, clock=lambda: now[0])
    now[0] = NOW + DAY - timedelta(microseconds=1)
    assert isinstance(ring.caller(text), Caller)
    now[0] = NOW + DAY
    assert "has expired" in str(ring.caller(text))
    assert not ring.has_valid_key()
    assert isinstance(ring.caller(text, may_be_expired=True), Caller)
    file.revoke("ann", NOW)
    ring.look()
    assert isinstance(ring.caller(text, may_be_expired=True), str)


def test_scopes_are_ordered() -> None:
    order = [Scope.READ, Scope.ANALYSE, Scope.MOVE, Scope.ADMIN]
    included = {(high, low) for high in Scope for low in Scope if high.includes(low)}
    assert included == {(high, low) for k, high in enumerate(order) for low in order[: k + 1]}


def test_the_form_of_the_file_is_stated(tmp_path: Path) -> None:
    KeyFile(tmp_path).add("ann", Scope.READ, NOW, None)
    assert json.loads((tmp_path / KEY_FILE).read_text())["form"] == "tauscope.keys/1"


def test_buckets_fill_at_their_rate() -> None:
    now = [100.0]
    limit = RateLimit(per_second=2.0, burst=3.0, clock=lambda: now[0])
    assert [limit.take("a") for _ in range(4)] == [0.0, 0.0, 0.0, 0.5]
    assert limit.take("b") == 0.0
    now[0] += 0.25
    assert limit.take("a") == 0.25
    now[0] += 0.25
    assert [limit.take("a"), limit.take("a")] == [0.0, 0.5]
    now[0] += 1e6
    assert [limit.take("a") > 0 for _ in range(4)] == [False, False, False, True]


def test_callers_without_number_fill_no_memory() -> None:
    limit = RateLimit(per_second=1.0, burst=1.0, clock=lambda: 0.0)
    for number in range(MOST_CALLERS + 50):
        limit.take(str(number))
    assert len(limit._buckets) == MOST_CALLERS
