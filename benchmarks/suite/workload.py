"""What is measured: workloads, and who contends in each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

Arrays = Mapping[str, Any]
"""NumPy arrays by name: the data of a workload, or an answer to it."""


class Lap(Protocol):
    """
    What a contender calls after each stage; what follows the last call is not timed.

    C++ peers measure their stages themselves, and give the seconds.
    """

    def __call__(self, stage: str, seconds: float | None = None) -> None:
        """End a stage."""


Run = Callable[[Lap], Arrays]
"""What is timed: from NumPy (or C) arrays to the finished answer."""


@dataclass(frozen=True)
class Contender:
    """
    A peer in one configuration.

    Attributes
    ----------
    peer : str
        Its name; contenders of one peer share a process.
    make : callable
        ``make(arrays, threads)`` returns what is timed. Called before every run, and not timed: imports,
        objects that users keep, and conversions that C++ users do not need, belong here.
    setting : str
        What tells it from the peer's other contenders.
    """

    peer: str
    make: Callable[[Arrays, int], Run]
    setting: str = ""

    @property
    def name(self) -> str:
        """The peer and the setting."""
        return f"{self.peer}, {self.setting}" if self.setting else self.peer


@dataclass(frozen=True)
class Bound:
    """
    The least that a kernel must move and compute, by a stated formula.

    Attributes
    ----------
    formula : str
        How the figures are counted.
    bytes, operations : float
        Memory traffic of a run; operations on floats of a run.
    """

    formula: str
    bytes: float = 0.0
    operations: float = 0.0


@dataclass(frozen=True)
class Workload:
    """
    One piece of work, the same for all contenders.

    Attributes
    ----------
    name, title : str
        For ``--only``; for readers.
    items : int
        Of what: points, pixels or frames. Memory is stated per item.
    data : callable
        Makes the arrays.
    contenders : list of Contender
        nacre among them.
    check : callable
        ``check(arrays, answer)`` returns the errors of an answer, by name.
    limits : mapping of str to float
        A contender with a larger error is listed, but not compared with.
    goal : float, optional
        How many times faster than the best peer nacre wants to be.
    milliseconds : float, optional
        What nacre wants to stay below.
    quick : bool
        Part of ``--quick``.
    most_threads_only : bool
        Not repeated for smaller numbers of threads.
    steps : int
        What a run does so many times; times are stated for one.
    bound : Bound, optional
        Of nacre's kernel.
    note : str
        Under the title.
    """

    name: str
    title: str
    items: int
    data: Callable[[], Arrays]
    contenders: list[Contender]
    check: Callable[[Arrays, Arrays], dict[str, float]]
    limits: Mapping[str, float]
    goal: float | None = None
    milliseconds: float | None = None
    quick: bool = True
    most_threads_only: bool = False
    steps: int = 1
    bound: Bound | None = None
    note: str = ""

    def contender(self, name: str) -> Contender:
        """Return the contender of this name."""
        return next(contender for contender in self.contenders if contender.name == name)
