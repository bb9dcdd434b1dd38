"""What is kept: recordings and the folders of finished and waiting work, as plain files that are never half written."""

from service.store.atomic import is_disk_full, write_atomically
from service.store.event_log import EventLog, LogFollower, LoggedEvent
from service.store.folder_lock import FolderLock
from service.store.incoming import IncomingFile, KeptFile, hash_file
from service.store.items import ItemStore
from service.store.layout import FOLDERS, RECORDINGS, item_stores
from service.store.names import FILE_NAME_RULE, is_file_name, is_identifier, new_identifier
from service.store.recordings import NameTakenError, RecordingStore, StoredRecording
from service.store.site import site_identifier

__all__ = [
    "FILE_NAME_RULE",
    "FOLDERS",
    "RECORDINGS",
    "EventLog",
    "FolderLock",
    "IncomingFile",
    "ItemStore",
    "KeptFile",
    "LogFollower",
    "LoggedEvent",
    "NameTakenError",
    "RecordingStore",
    "StoredRecording",
    "hash_file",
    "is_disk_full",
    "is_file_name",
    "is_identifier",
    "item_stores",
    "new_identifier",
    "site_identifier",
    "write_atomically",
]
