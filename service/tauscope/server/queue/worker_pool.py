"""Worker processes whose work has a deadline and a memory limit, and ends when its future is cancelled."""

import atexit
import os
import resource
import signal
import threading
import traceback
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from typing import Any, ParamSpec, TypeVar

from tauscope.errors import LimitExceededError

NICENESS = 10  # of a worker, so that the service answers a stop on a machine whose processors are all at work


def serve_connection(connection: Connection, memory_bytes: int | None, niceness: int) -> None:
    """Call functions until the other side is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the service's to handle
    os.nice(niceness)
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
    try:
        return True, function(*arguments, **options)
    except BaseException as error:
        return _describe_failure(error)


def _describe_failure(error: BaseException) -> tuple[bool, BaseException]:
    """What is sent of an exception: where it happened is part of it."""
    error.add_note("".join(traceback.format_exception(error)))
    return False, error


def _end_with_service() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
START_S = 120.0  # how long a process may take to start on a busy machine [s]
_THREAD_SETTINGS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_environment = threading.Lock()


_Call = tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any]]


class WorkerPool(Executor):
    """Spawned processes, one BLAS thread each; `Future.cancel` kills the process, and a bound ends it."""

    def __init__(
        self,
        workers: int,
        *,
        deadline_s: float | None = None,
        memory_bytes: int | None = None,
        niceness: int = NICENESS,
    ) -> None:
        """`deadline_s`: of a call [s]; `memory_bytes`: data that a process may hold. Processes start when needed."""
        self._deadline_s, self._memory_bytes, self._niceness = deadline_s, memory_bytes, niceness
        self._condition = threading.Condition()
        self._waiting: deque[tuple[Future[Any], _Call]] = deque()
        self._idle: list[_Worker] = []
        self._busy: set[_Worker] = set()
        self._is_closed = False
        self._threads = [threading.Thread(target=self._serve, daemon=True) for _ in range(workers)]
        self._has_begun = False
        self.obstacle: str | None = None
        """Why the last process that was needed did not start; None where it did."""

    def submit(
        self, fn: Callable[Arguments, Result], /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> "Future[Result]":
        """Have a function called in a process. Raises RuntimeError after `shutdown`."""
        future: Future[Result] = Future()
        with self._condition:
            if self._is_closed:
                raise RuntimeError("the pool is shut down")
            if not self._has_begun:
                self._has_begun = True
                atexit.register(self._kill_all)  # before multiprocessing waits for its processes
                for thread in self._threads:
                    thread.start()
            self._waiting.append((future, (fn, args, kwargs)))
            self._condition.notify()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        with self._condition:
            self._is_closed = True
            if cancel_futures:
                for future, _ in self._waiting:
                    future.cancel()
                for worker in self._busy:
                    worker.kill()
            self._condition.notify_all()
        if self._has_begun and wait:
            for thread in self._threads:
                thread.join()
            atexit.unregister(self._kill_all)

    def _kill_all(self) -> None:
        with self._condition:
            for worker in (*self._busy, *self._idle):
                worker.kill()

    def _serve(self) -> None:
        """Do one task after the other; on closing, those that wait still."""
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._waiting or self._is_closed)
                if not self._waiting:
                    break
                future, call = self._waiting.popleft()
            if not future.cancelled():
                self._do(future, call)
        with self._condition:
            idle, self._idle = self._idle, []
        for worker in idle:
            worker.close()

    def _do(self, future: "Future[Any]", call: _Call) -> None:
        try:
            worker = self._take_worker()
        except OSError as error:
            self.obstacle = f"no worker process can be started ({error.strerror})"
            return settle(future, BrokenProcessPool(self.obstacle))
        # A cancelled future is done at once: whatever works on it is of no use any more.
        future.add_done_callback(lambda done: worker.kill() if done.cancelled() else None)
        outcome = self._call(worker, call)
        is_reusable = outcome.is_clean and not future.cancelled()
        with self._condition:
            self._busy.discard(worker)
            if is_reusable:
                self._idle.append(worker)
        if not is_reusable:
            worker.close()
        settle(future, outcome.error, outcome.result)

    def _take_worker(self) -> "_Worker":
        """A process that is ready; raises OSError where none can be started."""
        with self._condition:
            worker = self._idle.pop() if self._idle else None
        worker = worker or _Worker(self._memory_bytes, self._niceness)
        with self._condition:
            self._busy.add(worker)
        return worker

    def _call(self, worker: "_Worker", call: _Call) -> "_Outcome":
        try:
            worker.begin(call)
        except (OSError, EOFError):
            self.obstacle = "worker processes end before their work begins"
            return _Outcome(BrokenProcessPool(self.obstacle), is_clean=False)
        except Exception as error:  # what cannot be pickled
            return _Outcome(error)
        self.obstacle = None
        try:
            if not worker.connection.poll(self._deadline_s):
                text = f"took longer than the {self._deadline_s:g} s that are given to it here; send less at once"
                return _Outcome(LimitExceededError(text), is_clean=False)
            has_succeeded, value = worker.connection.recv()
        except (OSError, EOFError):
            return _Outcome(BrokenProcessPool("the process ended in the middle of its work"), is_clean=False)
        except Exception as error:  # what cannot be unpickled
            return _Outcome(error, is_clean=False)
        if has_succeeded:
            return _Outcome(None, value)
        if isinstance(value, MemoryError) and self._memory_bytes is not None:
            text = f"needs more than the {self._memory_bytes // 2**20} MiB of memory that are given to it here"
            return _Outcome(LimitExceededError(f"{text}; send less at once"), is_clean=False)
        return _Outcome(value)


@dataclass(frozen=True)
class _Outcome:
    """How a call ended; the process can take another one where it ended cleanly."""

    error: BaseException | None
    result: Any = None
    is_clean: bool = True


def settle(future: "Future[Any]", error: BaseException | None, result: Any = None) -> None:
    """Tell a future how its work ended, unless it was cancelled."""
    if not future.set_running_or_notify_cancel():
        return
    if error is not None:
        future.set_exception(error)
    else:
        future.set_result(result)


class _Worker:
    def __init__(self, memory_bytes: int | None, niceness: int) -> None:
        context = get_context("spawn")
        self.connection: Connection
        self.connection, theirs = context.Pipe()
        self._is_ready = False
        self._process = context.Process(target=serve_connection, args=(theirs, memory_bytes, niceness))
        try:
            with _limit_threads():
                self._process.start()
        finally:
            theirs.close()  # the process has the only other end: when it dies, the connection does

    def begin(self, call: _Call) -> None:
        """Have it call a function. Raises OSError, EOFError if it has ended."""
        if not self._is_ready:
            if not self.connection.poll(START_S):
                raise EOFError("the process did not start")
            self.connection.recv()
            self._is_ready = True
        self.connection.send(call)

    def kill(self) -> None:
        with suppress(ValueError):  # closed already
            self._process.kill()

    def close(self) -> None:
        self.kill()
        self._process.join()
        self._process.close()
        self.connection.close()


@contextmanager
def _limit_threads() -> Iterator[None]:
    """What processes that are started meanwhile find in their environment; the user's own settings stay."""
    with _environment:
        added = [name for name in _THREAD_SETTINGS if name not in os.environ]
        os.environ.update(dict.fromkeys(added, "1"))
        try:
            yield
        finally:
            for name in added:
                del os.environ[name]
