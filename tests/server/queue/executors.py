"""Executors whose work is done when a test says so, or at once."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any


class ManualExecutor(Executor):
    """Keeps what is handed in; the test starts it, finishes it, or lets it fail."""

    def __init__(self) -> None:
        self.tasks: list[tuple[Future[Any], Callable[[], Any]]] = []
        self.refusal: Exception | None = None
        self.shutdowns: list[bool] = []

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self.refusal is not None:
            raise self.refusal
        future: Future[Any] = Future()
        self.tasks.append((future, lambda: fn(*args, **kwargs)))
        return future

    def run(self, place: int = 0) -> None:
        """Do the work that has waited longest."""
        future, call = self.tasks.pop(place)
        if not future.set_running_or_notify_cancel():
            return
        try:
            future.set_result(call())
        except Exception as error:
            future.set_exception(error)

    def fail(self, error: Exception) -> None:
        """End the work that has waited longest with an exception of the executor's own."""
        future, _ = self.tasks.pop(0)
        future.set_running_or_notify_cancel()
        future.set_exception(error)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self.shutdowns.append(cancel_futures)
        if cancel_futures:
            for future, _ in self.tasks:
                future.cancel()


class InlineExecutor(ManualExecutor):
    """Does everything at once, in the thread that hands it in."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future = super().submit(fn, *args, **kwargs)
        self.run(-1)
        return future
