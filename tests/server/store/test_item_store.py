"""Items that are folders, and the lock on their folder."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from tauscope.errors import NotFoundError, TauscopeError
from tauscope.server.store.data_folder import FolderLock, ItemStore


@pytest.fixture
def store(tmp_path: Path) -> ItemStore:
    seconds = iter(range(60))
    return ItemStore(
        tmp_path / "items", "identification", lambda: datetime(2026, 11, 3, 10, 0, next(seconds), tzinfo=UTC)
    )


def test_a_staged_folder_is_no_item_before_it_is_published(store: ItemStore) -> None:
    staged = store.stage()
    (staged / "order.json").write_bytes(b"{}")
    assert store.identifiers() == []
    identifier = store.publish(staged)
    assert store.identifiers() == [identifier]
    assert (store.folder(identifier) / "order.json").read_bytes() == b"{}"
    store.discard(staged)
    assert store.identifiers() == [identifier]


def test_the_newest_comes_first(store: ItemStore) -> None:
    first, second = (store.publish(store.stage()) for _ in range(2))
    assert store.identifiers() == [second, first]


def test_removed_is_gone_with_its_files(store: ItemStore) -> None:
    identifier = store.publish(store.stage())
    store.remove(identifier)
    assert list(store.root.iterdir()) == []


@pytest.mark.parametrize("identifier", ["", "..", "../../etc", "20261103T100000Z-00000000", "x\ny"])
def test_what_is_not_there(identifier: str, store: ItemStore) -> None:
    store.publish(store.stage())
    for ask in (store.folder, store.remove):
        with pytest.raises(NotFoundError, match=r"no identification .* is kept here") as raised:
            ask(identifier)
        assert "\n" not in str(raised.value)


def test_leftovers_of_a_crash_are_tidied_away_and_items_are_not(store: ItemStore) -> None:
    identifier = store.publish(store.stage())
    store.stage()
    (store.root / ".removed-20261103T100000Z-00000000").mkdir()
    store.tidy()
    assert [entry.name for entry in store.root.iterdir()] == [identifier]


def test_one_service_a_folder(tmp_path: Path) -> None:
    lock = FolderLock(tmp_path)
    with pytest.raises(TauscopeError, match="another tauscope service works with this folder"):
        FolderLock(tmp_path)
    lock.release()
    FolderLock(tmp_path).release()
