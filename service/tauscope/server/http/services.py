"""What the routes work with, made once an application."""

import threading
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Annotated, cast

from anyio import CapacityLimiter
from fastapi import Depends, Request

from tauscope.server.auth.audit_log import AuditTrail
from tauscope.server.auth.gate import Access
from tauscope.server.control.campaign_manager import CampaignManager
from tauscope.server.control.leases import Leases
from tauscope.server.control.run_manager import RunManager
from tauscope.server.history.indexer import Indexer
from tauscope.server.history.model_registry import ModelRegistry
from tauscope.server.http.heartbeat import Heartbeat
from tauscope.server.http.idempotency.answers import Answers
from tauscope.server.http.operations.metrics import Metrics
from tauscope.server.http.settings import Settings
from tauscope.server.queue.queue import JobKind, JobQueue
from tauscope.server.schedules.scheduler import Scheduler
from tauscope.server.store.recordings import RecordingStore


@dataclass(frozen=True)
class Services:
    """What the routes work with."""

    settings: Settings
    recordings: RecordingStore
    identifications: JobKind
    diagnoses: JobKind
    excitations: JobKind
    jobs: JobQueue
    runs: RunManager
    campaigns: CampaignManager
    checks: Executor
    access: Access
    leases: Leases
    audit: AuditTrail
    answers: Answers
    lease_answers: Answers
    metrics: Metrics
    pulse: Heartbeat
    index: Indexer
    models: ModelRegistry
    schedules: Scheduler
    followers: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(4))
    closing: threading.Event = field(default_factory=threading.Event)

    def begin_to_close(self) -> None:
        """Stop every arm, and let go of whoever follows events; returns at once."""
        self.closing.set()
        self.campaigns.stop_all()
        self.runs.stop_all()


async def _services_of(request: Request) -> Services:
    """The services of the application that answers; a coroutine, so that no thread has to be free for it."""
    return cast(Services, request.app.state.services)


ServicesDep = Annotated[Services, Depends(_services_of)]
"""The services, as an argument of a route."""
