"""The database: an index of the folders, and what has no folder."""

from service.store.database.base import Base
from service.store.database.database import FILE_NAME, Database
from service.store.database.facts import FileFacts, ItemEntry, ItemFacts, ItemQuery, RecordingRole, RobotEntry
from service.store.database.index import Index
from service.store.database.model_entries import ModelEntry, ModelEventEntry
from service.store.database.model_history import ModelHistory
from service.store.database.model_judgement import Candidate, compared
from service.store.database.schedule_book import ScheduleBook
from service.store.database.schedule_entries import FiringEntry, ScheduleEntry
from service.store.database.tables import ITEM_CLASSES

__all__ = [
    "FILE_NAME",
    "ITEM_CLASSES",
    "Base",
    "Candidate",
    "Database",
    "FileFacts",
    "FiringEntry",
    "Index",
    "ItemEntry",
    "ItemFacts",
    "ItemQuery",
    "ModelEntry",
    "ModelEventEntry",
    "ModelHistory",
    "RecordingRole",
    "RobotEntry",
    "ScheduleBook",
    "ScheduleEntry",
    "compared",
]
