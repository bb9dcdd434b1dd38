"""A worker process from its own side: it calls what it is sent, one after the other, and ends with its service."""

import os
import pickle
import resource
import signal
import threading
import traceback
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from typing import Any


def serve_connection(connection: Connection, memory_bytes: int | None) -> None:
    """Call functions until the other side is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the service's to handle
    threading.Thread(target=_end_with_service, daemon=True).start()
    if memory_bytes is not None:
        resource.setrlimit(resource.RLIMIT_DATA, (memory_bytes, memory_bytes))
    connection.send(None)
    while True:
        try:
            call = connection.recv_bytes()
        except (EOFError, OSError):
            return
        answer = _answer(call)
        connection.send_bytes(answer)


def _answer(call: bytes) -> bytes:
    """What comes of a call, as the other side reads it: whether it succeeded, and its result or exception."""
    try:
        function, arguments, options = pickle.loads(call)  # noqa: S301 - our own service wrote it
        return pickle.dumps((True, function(*arguments, **options)))
    except BaseException as error:
        error.add_note("".join(traceback.format_exception(error)))
        return _packed(error)


def _packed(error: BaseException) -> bytes:
    """An exception that failed; one that cannot be sent is described."""
    try:
        content = pickle.dumps((False, error))
        pickle.loads(content)  # noqa: S301 - written in the line before
    except Exception:
        described: Any = (False, RuntimeError("".join(traceback.format_exception(error))))
        return pickle.dumps(described)
    return content


def _end_with_service() -> None:
    """End this process when the service is gone."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
