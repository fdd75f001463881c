"""Ranks as the processes of an MPI job, by mpi4py."""

from __future__ import annotations

import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import TYPE_CHECKING, Any, TypeVar, cast

from ._errors import RankError

if TYPE_CHECKING:
    from mpi4py import MPI

    Buffer = bytes | bytearray | memoryview

Value = TypeVar("Value")
Function = TypeVar("Function", bound=Callable[..., Any])

#: The longest message in bytes: older versions of MPI count by 32 bits.
_CHUNK = 1 << 30
#: Exit status of a job in which a process failed.
_RANK_FAILED = 5
_TAG_ROOTED = 1
#: Used alternately: a process can be one exchange ahead of another, but never two.
_TAGS_EXCHANGE = (2, 3)

#: The key of the duplicate that belongs to a communicator.
_key: int | None = None


def _operation(function: Function) -> Function:
    """A collective operation: if it fails here, the others wait for it, so the job must end.

    Ctrl-C does not end it in the middle, but is noted.
    """

    @wraps(function)
    def whole(self: Processes, *arguments: Any) -> Any:
        try:
            with self._uninterrupted():
                return function(self, *arguments)
        except BaseException:
            traceback.print_exc()
            self.end_job()
            raise

    return cast(Function, whole)


class Processes:
    """The processes of a communicator, for the library.

    It calls one method at a time, in the thread that called the library. Messages are bytes-like;
    results are bytearrays. Messages of more than `chunk` bytes are sent in several parts, of which
    only the last one is shorter.
    """

    def __init__(self, comm: MPI.Intracomm, chunk: int = _CHUNK) -> None:
        from mpi4py import MPI

        self._mpi = MPI
        self._duplicate = duplicate_of(comm)
        self._comm = self._duplicate.comm
        self._chunk = chunk
        self._interrupted = False
        self.rank = self._comm.Get_rank()
        self.size = self._comm.Get_size()

    def take_interrupt(self) -> bool:
        """Whether Ctrl-C was pressed during an operation; once."""
        interrupted, self._interrupted = self._interrupted, False
        return interrupted

    def _note_interrupt(self, *_: object) -> None:
        self._interrupted = True

    @contextmanager
    def _uninterrupted(self) -> Iterator[None]:
        handler = signal.getsignal(signal.SIGINT)
        if handler is None or threading.current_thread() is not threading.main_thread():
            # Python handles signals in its main thread, if at all.
            yield
            return
        signal.signal(signal.SIGINT, self._note_interrupt)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, handler)

    def end_job(self) -> None:
        """Ends all processes."""
        sys.stdout.flush()
        sys.stderr.flush()
        self._comm.Abort(_RANK_FAILED)

    @_operation
    def barrier(self) -> None:
        self._comm.Barrier()

    def _chunks(self, message: Buffer) -> Iterator[memoryview]:
        """The parts of a message; the last one is shorter than the limit."""
        view = memoryview(message)
        for start in range(0, len(view) + 1, self._chunk):
            yield view[start : start + self._chunk]

    def _send(self, to: int, message: Buffer) -> None:
        for chunk in self._chunks(message):
            self._comm.Send([chunk, self._mpi.BYTE], to, _TAG_ROOTED)

    def _receive(self, source: int) -> bytearray:
        message = bytearray()
        status = self._mpi.Status()
        while True:
            probed = self._comm.Mprobe(source, _TAG_ROOTED, status)
            chunk = bytearray(status.Get_count(self._mpi.BYTE))
            probed.Recv([chunk, self._mpi.BYTE])
            message += chunk
            if len(chunk) < self._chunk:
                return message

    @_operation
    def broadcast(self, root: int, message: Buffer) -> bytearray:
        """Gives all the message of one."""
        length = self._comm.bcast(len(message), root)
        result = bytearray(message) if self.rank == root else bytearray(length)
        for chunk in self._chunks(result):
            if len(chunk):
                self._comm.Bcast([chunk, self._mpi.BYTE], root)
        return result

    @_operation
    def gather(self, root: int, message: Buffer) -> list[bytearray]:
        """Gives one the messages of all, by rank; the others get no messages."""
        if self.rank != root:
            self._send(root, message)
            return []
        return [bytearray(message) if rank == root else self._receive(rank) for rank in range(self.size)]

    @_operation
    def all_gather(self, message: Buffer) -> list[bytearray]:
        """Gives all the messages of all, by rank."""
        lengths = self._comm.allgather(len(message))
        if sum(lengths) > self._chunk:
            return [self.broadcast(rank, message) for rank in range(self.size)]
        joined = bytearray(sum(lengths))
        starts = [sum(lengths[:rank]) for rank in range(self.size)]
        self._comm.Allgatherv([message, self._mpi.BYTE], [joined, (lengths, starts), self._mpi.BYTE])
        return [joined[start : start + length] for start, length in zip(starts, lengths)]

    @_operation
    def all_gather_equal(self, message: Buffer) -> bytearray:
        """Gives all the messages of all, which are of one length, joined."""
        if len(message) * self.size > self._chunk:
            return bytearray().join(self.all_gather(message))
        joined = bytearray(len(message) * self.size)
        if joined:
            self._comm.Allgather([message, self._mpi.BYTE], [joined, self._mpi.BYTE])
        return joined

    @_operation
    def scatter(self, root: int, messages: list[bytes] | None) -> bytearray:
        """Gives each its message of those of one."""
        if messages is None:
            return self._receive(root)
        for rank, message in enumerate(messages):
            if rank != root:
                self._send(rank, message)
        return bytearray(messages[root])

    @_operation
    def exchange(self, messages: list[tuple[int, bytes]]) -> list[tuple[int, bytearray]]:
        """Sends messages to some, and returns those received, by ascending sender.

        Nonblocking consensus (Hoefler, Siebert, Lumsdaine 2010, algorithm NBX): send synchronously
        and receive; when all messages of this process have been received, enter a nonblocking
        barrier; when all have entered it, no message is in transit.
        """
        tag = self._duplicate.next_tag()
        received: list[list[bytearray]] = [[] for _ in range(self.size)]
        incomplete = [bytearray() for _ in range(self.size)]
        received[self.rank] = [bytearray(message) for to, message in messages if to == self.rank]
        sends = [
            self._comm.Issend([chunk, self._mpi.BYTE], to, tag)
            for to, message in messages
            if to != self.rank
            for chunk in self._chunks(message)
        ]
        status = self._mpi.Status()
        barrier: MPI.Request | None = None
        while barrier is None or not barrier.Test():
            probed = self._comm.Improbe(self._mpi.ANY_SOURCE, tag, status)
            if probed is not None:
                source = status.Get_source()
                chunk = bytearray(status.Get_count(self._mpi.BYTE))
                probed.Recv([chunk, self._mpi.BYTE])
                incomplete[source] += chunk
                if len(chunk) < self._chunk:
                    received[source].append(incomplete[source])
                    incomplete[source] = bytearray()
            elif barrier is None and self._mpi.Request.Testall(sends):
                barrier = self._comm.Ibarrier()
            else:
                # Others may share this core.
                time.sleep(0)
        return [(source, message) for source, of_rank in enumerate(received) for message in of_rank]


class _Duplicate:
    """A duplicate of a communicator, which all meshes on it share."""

    def __init__(self, comm: MPI.Intracomm) -> None:
        from mpi4py import MPI

        self.comm = comm.Dup()
        # An error of MPI ends the job: no process can go on without the message.
        self.comm.Set_errhandler(MPI.ERRORS_ARE_FATAL)
        self._exchanges = 0

    def next_tag(self) -> int:
        """The tag of the next exchange, whichever mesh it belongs to."""
        self._exchanges += 1
        return _TAGS_EXCHANGE[self._exchanges % 2]


def duplicate_of(comm: MPI.Intracomm) -> _Duplicate:
    """The duplicate of a communicator for this package, so that messages do not mix.

    It is made once, and freed with the communicator.
    """
    from mpi4py import MPI

    global _key
    if _key is None:
        _key = MPI.Comm.Create_keyval(delete_fn=lambda comm, key, duplicate: duplicate.comm.Free())
    duplicate = comm.Get_attr(_key)
    if duplicate is None:
        duplicate = _Duplicate(comm)
        comm.Set_attr(_key, duplicate)
    return cast(_Duplicate, duplicate)


def communicator(comm: Any) -> MPI.Intracomm:
    """The communicator of mpi4py that an argument is: also one of petsc4py."""
    try:
        from mpi4py import MPI
    except ImportError as missing:
        raise ImportError("comm needs the package mpi4py, for the MPI library that starts this program") from missing
    if hasattr(comm, "tompi4py"):
        comm = comm.tompi4py()
    if isinstance(comm, MPI.Comm) and comm == MPI.COMM_NULL:
        raise ValueError("comm is MPI.COMM_NULL: this process is not in the communicator")
    if not isinstance(comm, MPI.Intracomm):
        raise TypeError(f"comm must be a communicator of mpi4py, such as MPI.COMM_WORLD, not {comm!r}")
    if MPI.Query_thread() < MPI.THREAD_SERIALIZED and not MPI.Is_thread_main():
        raise RuntimeError("MPI was initialised for one thread: make meshes in that one")
    return comm


def agreed(comm: MPI.Intracomm, make: Callable[[], Value]) -> Value:
    """*Collective.* What `make` returns, unless it raises in any process: then all raise."""
    failure: Exception | None = None
    value: Value | None = None
    try:
        value = make()
    except Exception as error:
        failure = error
    texts = comm.allgather(None if failure is None else f"{type(failure).__name__}: {failure}")
    if failure is not None:
        raise failure
    for rank, text in enumerate(texts):
        if text is not None:
            raise RankError(f"process {rank}: {text}")
    return cast(Value, value)
