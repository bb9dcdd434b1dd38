"""Recordings on the server: kept once, found by name only, never overwritten."""

import hashlib
import os
from pathlib import Path
from tempfile import mkdtemp

import pytest

from tauscope.errors import LimitExceededError, NotFoundError, RecordingError
from tauscope.server.store.files import IncomingFile, KeptFile
from tauscope.server.store.recordings import NameTakenError, RecordingHashes, RecordingStore


@pytest.fixture
def store(tmp_path: Path) -> RecordingStore:
    return RecordingStore(tmp_path / "recordings")


def arrive(store: RecordingStore, name: str, content: bytes) -> KeptFile:
    incoming = IncomingFile(Path(mkdtemp(dir=store.root, prefix=".incoming-")), name, limit=1000)
    for byte in content:
        incoming.write(bytes([byte]))
    return incoming.finish()


def test_a_recording_is_kept_with_its_hash(store: RecordingStore) -> None:
    kept, is_new = store.keep(arrive(store, "a.csv", b"t,q1,tau1"))
    assert is_new
    assert (kept.name, kept.size) == ("a.csv", 9)
    assert kept.sha256 == hashlib.sha256(b"t,q1,tau1").hexdigest()
    assert store.path("a.csv").read_bytes() == b"t,q1,tau1"
    assert store.entries() == [kept]


def test_the_same_bytes_again_are_welcome_and_others_are_not(store: RecordingStore) -> None:
    store.keep(arrive(store, "a.csv", b"first"))
    _, is_new = store.keep(arrive(store, "a.csv", b"first"))
    assert not is_new
    with pytest.raises(NameTakenError, match=r"a\.csv.*another name"):
        store.keep(arrive(store, "a.csv", b"second"))
    assert store.path("a.csv").read_bytes() == b"first"


def test_a_name_that_is_a_path_is_refused(store: RecordingStore, tmp_path: Path) -> None:
    staged = arrive(store, "a.csv", b"x")
    with pytest.raises(RecordingError, match="no name for a recording"):
        store.keep(KeptFile(staged.path, "../../escaped.csv", staged.size, staged.sha256))
    assert not (tmp_path.parent / "escaped.csv").exists()
    assert store.entries() == []


def test_a_file_that_grows_too_large_stops_at_the_limit(store: RecordingStore) -> None:
    incoming = IncomingFile(Path(mkdtemp(dir=store.root, prefix=".incoming-")), "a.csv", limit=10)
    incoming.write(b"0123456789")
    with pytest.raises(LimitExceededError, match=r"a\.csv: is larger than the 10 bytes"):
        incoming.write(b"0")
    incoming.discard()
    incoming.discard()
    assert not incoming.path.exists()


def test_files_that_the_operator_put_there_are_found_and_rehashed_when_they_change(store: RecordingStore) -> None:
    file = store.root / "by-hand.csv"
    file.write_bytes(b"one")
    assert [entry.sha256 for entry in store.entries()] == [None]
    first = store.find("by-hand.csv").sha256
    assert [entry.sha256 for entry in store.entries()] == [first]
    file.write_bytes(b"two!")
    assert store.find("by-hand.csv").sha256 == hashlib.sha256(b"two!").hexdigest() != first


def test_a_damaged_memory_of_hashes_is_computed_anew(store: RecordingStore) -> None:
    store.keep(arrive(store, "a.csv", b"content"))
    (memory,) = (store.root / ".sha256").iterdir()
    for damage in (b"", b"[]", b"{}", b"\xff", b'{"size": "7"}'):
        memory.write_bytes(damage)
        assert store.find("a.csv").sha256 == hashlib.sha256(b"content").hexdigest()


@pytest.mark.parametrize("name", ["..", "../outside.csv", "link.csv", "folder", ".sha256", "missing.csv", "a\0b", ""])
def test_only_regular_files_of_the_folder_are_found(name: str, store: RecordingStore, tmp_path: Path) -> None:
    (tmp_path / "outside.csv").write_bytes(b"secret")
    (store.root / "link.csv").symlink_to(tmp_path / "outside.csv")
    (store.root / "folder").mkdir()
    for ask in (store.path, store.find, store.digest, store.remove):
        with pytest.raises(NotFoundError, match="lies on the server"):
            ask(name)
    assert store.entries() == []
    assert (tmp_path / "outside.csv").read_bytes() == b"secret"


def test_a_pipe_is_no_recording(store: RecordingStore) -> None:
    os.mkfifo(store.root / "pipe.csv")
    with pytest.raises(NotFoundError):
        store.find("pipe.csv")


def test_a_link_does_not_count_as_the_same_bytes(store: RecordingStore, tmp_path: Path) -> None:
    (tmp_path / "outside.csv").write_bytes(b"same")
    (store.root / "a.csv").symlink_to(tmp_path / "outside.csv")
    with pytest.raises(NameTakenError):
        store.keep(arrive(store, "a.csv", b"same"))


def test_removed_is_gone(store: RecordingStore) -> None:
    store.keep(arrive(store, "a.csv", b"x"))
    store.remove("a.csv")
    assert store.entries() == []
    assert list((store.root / ".sha256").iterdir()) == []


def test_uploads_that_a_crash_cut_off_are_tidied_away(store: RecordingStore) -> None:
    arrive(store, "a.csv", b"x")
    store.tidy()
    assert [entry.name for entry in store.root.iterdir()] == [".sha256"]


@pytest.mark.parametrize("damage", ["one bit", "cut off", "emptied"])
@pytest.mark.parametrize("is_told_by_its_time", [True, False])
def test_a_kept_recording_that_is_damaged_is_shown_as_such(
    damage: str, is_told_by_its_time: bool, store: RecordingStore
) -> None:
    store.keep(arrive(store, "a.csv", b"content"))
    path = store.path("a.csv")
    before = path.stat()
    path.write_bytes({"one bit": b"bontent", "cut off": b"cont", "emptied": b""}[damage])
    if not is_told_by_its_time:
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    else:
        os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 1))
    is_seen_at_once = is_told_by_its_time or damage != "one bit"
    assert [entry.is_damaged for entry in store.entries()] == [is_seen_at_once]
    assert store.damaged(deep=False) == (["a.csv"] if is_seen_at_once else [])
    assert store.damaged(deep=True) == ["a.csv"]
    assert store.find("a.csv").is_damaged
    with pytest.raises(RecordingError, match=r"a\.csv: is damaged.*send it again"):
        store.digest("a.csv")
    path.write_bytes(b"content")  # restored
    assert store.damaged(deep=True) == []
    assert store.digest("a.csv") == hashlib.sha256(b"content").hexdigest()


def test_a_full_disk_keeps_no_recording_of_which_nothing_is_known(
    store: RecordingStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    arrived = arrive(store, "a.csv", b"content")
    store.keep(arrive(store, "b.csv", b"before"))
    with monkeypatch.context() as patched:
        patched.setattr("tauscope.server.store.recordings.write_atomically", full)
        with pytest.raises(OSError, match="No space"):
            store.keep(arrived)
        os.utime(store.path("b.csv"))
        assert store.find("b.csv").sha256 == hashlib.sha256(b"before").hexdigest()  # looking needs no room
    assert [entry.name for entry in store.entries()] == ["b.csv"]


def test_a_crash_before_a_recording_has_its_name_leaves_nothing_behind(
    store: RecordingStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    def die(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(os, "link", die)
        with pytest.raises(KeyboardInterrupt):
            store.keep(arrive(store, "a.csv", b"content"))
    again = RecordingStore(store.root)
    again.tidy()
    (store.root / "a.csv").write_bytes(b"put there by hand")
    assert [entry.is_damaged for entry in again.entries()] == [False]


def test_every_flipped_bit_of_what_is_remembered_is_noticed(store: RecordingStore) -> None:
    store.keep(arrive(store, "a.csv", b"content"))
    hashes, status = RecordingHashes(store.root / ".sha256"), store.path("a.csv").stat()
    (memory,) = (store.root / ".sha256").iterdir()
    content, known = memory.read_bytes(), hashes.of("a.csv", status)
    assert known is not None
    for bit in range(8 * len(content)):
        flipped = bytearray(content)
        flipped[bit // 8] ^= 1 << (bit % 8)
        memory.write_bytes(flipped)
        assert hashes.of("a.csv", status) in (None, known)
