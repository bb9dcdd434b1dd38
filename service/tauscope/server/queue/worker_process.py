"""A worker process from its own side: it calls what it is sent, one after the other, and ends with its service."""

import os
import resource
import signal
import threading
import traceback
from collections.abc import Callable
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
            call = connection.recv()
        except (EOFError, OSError):
            return
        except Exception as error:  # the function cannot be imported here
            answer = _describe_failure(error)
        else:
            answer = _call(*call)
        try:
            connection.send(answer)
        except Exception as error:  # what cannot be sent is described
            connection.send((False, RuntimeError("".join(traceback.format_exception(error)))))


def _call(function: Callable[..., Any], arguments: tuple[Any, ...], options: dict[str, Any]) -> tuple[bool, Any]:
    """What comes of a call: whether it succeeded, and its result or exception."""
    try:
        return True, function(*arguments, **options)
    except BaseException as error:
        return _describe_failure(error)


def _describe_failure(error: BaseException) -> tuple[bool, BaseException]:
    """What is sent of an exception: where it happened is part of it."""
    error.add_note("".join(traceback.format_exception(error)))
    return False, error


def _end_with_service() -> None:
    """End this process when the service is gone."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
