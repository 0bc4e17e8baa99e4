"""Studies: many runs of one model, on the processors of one machine or on any executor."""

from __future__ import annotations

import html
import json
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from functools import lru_cache
from multiprocessing import get_context, parent_process
from pathlib import Path
from types import FrameType
from typing import Any

from . import _core, _toml
from ._errors import DefinitionError, Error
from ._problem import Model, says_stop, text_of
from ._results import Figure, Page

# Number of lost workers after which a run that was alone on its worker counts as the cause.
DEATHS = 3
# Target duration of a task in seconds: sending one takes some milliseconds.
TASK_TIME = 0.2
# Largest number of tasks that wait or run at the same time.
TASKS = 256
# Longest time in seconds until an interrupt is noticed.
PAUSE = 0.2
# Exceptions that say that a worker died or was lost: `KilledWorker` is Dask's, `ExecutorlibSocketError` that of executorlib.
LOST = ("KilledWorker", "ExecutorlibSocketError", "FutureCancelledError", "CommClosedError", "LostTaskError")


# Name and text of a study, name and text of its model, and the folder in which the program of the model may run.
Texts = tuple[str, str, str, str, str | None]


class StudyError(Error):
    """A study ended before all of its runs were done. `result` has the rows so far; nothing is lost."""

    result: StudyResult

    def __init__(self, message: str, result: StudyResult | None = None) -> None:
        super().__init__(message)
        if result is not None:
            self.result = result


@lru_cache(maxsize=8)
def _core_of(texts: Texts) -> _core.Study:
    """The study of a task: a worker reads it once."""
    return _core.Study(*texts)


def _task(texts: Texts, phase: int, runs: list[int], known: list[str]) -> tuple[float, list[str]]:
    """Does runs in a worker. A pure function: it may run twice."""
    begun = time.perf_counter()
    lines = _core_of(texts).run(phase, runs, known)
    return time.perf_counter() - begun, lines


def _begin_worker() -> None:
    """Limit a worker of a pool to one thread, and end it when the parent process ends."""
    os.environ["RAYON_NUM_THREADS"] = "1"
    parent = parent_process()

    def follow() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


class _Processes:
    """Makes pools of worker processes."""

    def __init__(self, workers: int) -> None:
        self.workers = workers

    def __call__(self) -> Executor:
        # A forked process has no threads of the library.
        return ProcessPoolExecutor(self.workers, mp_context=get_context("spawn"), initializer=_begin_worker)


class Study:
    """Many runs of one model, and the conclusions from them.

    Parameters
    ----------
    table : mapping or str
        The keys of a study file (docs/studies.md), or its text. ``version`` is 1 by default; `model` is not needed.
    model : Model
        The model.
    name : str
        Name of the study in messages.

    Notes
    -----
    A run is a pure function of its number. The rows are the same for any number of threads, for any executor, and after interruptions.

    Examples
    --------
    >>> import linkwright
    >>> model = linkwright.Model.from_dict({
    ...     "design": {"width": {"start": 3.0}}, "output": [{"name": "stress", "value": "1/width"}]})
    >>> study = linkwright.Study({"kind": "grid", "vary": {"width": {"from": 1.0, "to": 2.0, "points": 3}}}, model)
    >>> study.run().table()["stress"]
    [1.0, 0.6666666666666666, 0.5]
    """

    def __init__(self, table: Mapping[str, Any] | str, model: Model, name: str = "study") -> None:
        if not isinstance(model, Model):
            raise DefinitionError(f"the model of a study is a linkwright.Model, got {type(model).__name__}")
        if isinstance(table, Mapping):
            table = _toml.dumps({"version": 1, "model": model.name, **table})
        elif not isinstance(table, str):
            raise DefinitionError(f"a study is a dictionary of keys or the text of a study file, got {type(table).__name__}")
        self._texts = (name, table, model.name, model.text, model.programs)
        self._core = _core.Study(*self._texts)

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], *, allow_programs: bool = False) -> Study:
        """Read a study file and the model that it names.

        Parameters
        ----------
        path : path
            The study file.
        allow_programs : bool
            The model may start the program that it names, see :meth:`linkwright.Model.from_file`.
        """
        place = os.fsdecode(path)
        text = text_of(place)
        name = _core.study_model(place, text)
        return cls(text, Model.from_file(Path(place).parent / name, allow_programs=allow_programs), place)

    def __reduce__(self) -> Any:
        return _restored, self._texts

    @property
    def title(self) -> str:
        """The title."""
        return self._core.title

    @property
    def runs(self) -> dict[str, int]:
        """Number of runs of each phase."""
        return {phase[0]: phase[2] for phase in self._core.phases}

    def __repr__(self) -> str:
        return f"<Study {self.title!r}: {sum(self.runs.values())} runs>"

    def run(
        self,
        executor: Executor | Callable[[], Executor] | int | None = None,
        file: str | os.PathLike[str] | None = None,
        *,
        resume: StudyResult | None = None,
        chunk: int | None = None,
        progress: Callable[[int, int], Any] | None = None,
    ) -> StudyResult:
        """Do the runs that have no row yet.

        Parameters
        ----------
        executor : Executor, callable, int, optional
            Where the runs are done. By default in the threads of this process. A number of worker processes; any
            :class:`concurrent.futures.Executor` (a process pool, ``dask.distributed.Client.get_executor()``,
            ``mpi4py.futures.MPIPoolExecutor``, executorlib); or a function that makes one, which is called again if the loss of
            a worker has broken the executor.
        file : path, optional
            File of rows, in the form of `rows.jsonl` (docs/studies.md). Each row is written as soon as it is known; rows that
            are in the file are not done again.
        resume : StudyResult, optional
            Rows of an earlier call, which are not done again.
        chunk : int, optional
            Runs of one task; by default as many as take about 0.2 s.
        progress : callable, optional
            Called with the number of rows and the number of runs; returning True stops the study.

        Returns
        -------
        StudyResult
            The rows. Some are missing if `progress` stopped the study.

        Raises
        ------
        StudyError
            If the executor is broken, or a run kills its worker each time; `result` has the rows so far. Other exceptions of a task
            arrive with their traceback.
        """
        if chunk is not None and (isinstance(chunk, bool) or not isinstance(chunk, int) or chunk < 1):
            raise DefinitionError(f"`chunk` is a number of runs from 1, got {chunk!r}")
        rows = _Rows(self, file, resume)
        try:
            where = _where(executor, rows)
            try:
                self._run(rows, where, chunk, progress)
            finally:
                where.end()
            if not rows.missing():
                rows.finish()
        finally:
            rows.close()
        return rows.result()

    def _run(self, rows: _Rows, where: _Here | _Pool, chunk: int | None, progress: Callable[[int, int], Any] | None) -> None:
        total = sum(self.runs.values())

        def observe(lines: Iterable[str]) -> bool:
            rows.add(lines)
            return progress is not None and says_stop(progress(len(rows.lines), total))

        for number, (_, _, count, waves) in enumerate(self._core.phases):
            for wave in waves if waves is not None else [range(count)]:
                missing = [run for run in wave if (number, run) not in rows.lines]
                # Runs may need the rows of earlier phases and waves.
                known = [line for (phase, _), line in rows.lines.items() if phase < number or (phase == number and waves is not None)]
                if missing and where.run(self._texts, number, missing, known, chunk, observe):
                    return


def _restored(name: str, text: str, model_name: str, model_text: str, programs: str | None) -> Study:
    return Study(text, Model(model_text, model_name, programs=programs), name)


class _Rows:
    """The rows so far, in memory and in a file."""

    def __init__(self, study: Study, file: str | os.PathLike[str] | None, resume: StudyResult | None) -> None:
        self.study = study
        self.lines: dict[tuple[int, int], str] = {}
        self.file: _core.RowFile | None = None
        stored: list[str] = []
        if file is not None:
            path = Path(file)
            self.file, stored = _core.RowFile.open(os.fspath(path.parent), path.name, study._core)
        self._keep(stored)
        if resume is not None:
            if not isinstance(resume, StudyResult):
                raise DefinitionError(f"`resume` is a result of `run`, got {type(resume).__name__}")
            if resume._study._core.header != study._core.header:
                raise DefinitionError("`resume` has the rows of another study; give a result of this study")
            self.add(line for key, line in resume._lines.items() if key not in self.lines)

    def _keep(self, lines: Iterable[str]) -> None:
        for line in lines:
            row = json.loads(line)
            self.lines[row.get("phase", 0), row["run"]] = line

    def add(self, lines: Iterable[str]) -> None:
        lines = list(lines)
        if self.file is not None and lines:
            self.file.append(lines)
        self._keep(lines)

    def missing(self) -> int:
        return sum(self.study.runs.values()) - len(self.lines)

    def finish(self) -> None:
        """Put the rows of the file into their order."""
        if self.file is not None:
            self.file.finish(self.study._core.text(list(self.lines.values())))

    def close(self) -> None:
        if self.file is not None:
            self.file.close()

    def result(self) -> StudyResult:
        return StudyResult(self.study, dict(sorted(self.lines.items())))


Observe = Callable[[Iterable[str]], bool]


class _Here:
    """The threads of this process."""

    def run(
        self, texts: Texts, phase: int, runs: list[int], known: list[str], chunk: int | None, observe: Observe
    ) -> bool:
        study, size = _core_of(texts), chunk or 1
        while runs:
            begun = time.perf_counter()
            lines = study.run(phase, runs[:size], known)
            runs = runs[size:]
            if observe(lines):
                return True
            # Ctrl-C is seen between two calls.
            if chunk is None:
                size = max(1, min(4 * size, int(size * TASK_TIME / max(time.perf_counter() - begun, 1e-6))))
        return False

    def end(self) -> None:
        pass


def _where(executor: Any, rows: _Rows) -> _Here | _Pool:
    if executor is None:
        return _Here()
    if isinstance(executor, bool) or (isinstance(executor, int) and executor < 1):
        raise DefinitionError(f"the number of worker processes is at least 1, got {executor!r}")
    if isinstance(executor, int):
        return _Pool(_Processes(executor), None, rows)
    if callable(getattr(executor, "submit", None)):
        return _Pool(None, executor, rows)
    if callable(executor):
        return _Pool(executor, None, rows)
    kind = type(executor).__name__
    raise DefinitionError(f"`executor` is an executor, a function that makes one, or a number of processes, got {kind}")


class _Interrupt:
    """Holds back an interrupt until `check`: an exception inside an executor can leave its locks acquired forever.

    A second interrupt is not held back.
    """

    def __init__(self) -> None:
        self.received: tuple[int, FrameType | None] | None = None
        self.before: Callable[[int, FrameType | None], Any] | None = None

    def __enter__(self) -> _Interrupt:
        before = signal.getsignal(signal.SIGINT)
        if threading.current_thread() is threading.main_thread() and callable(before):
            self.before = before
            signal.signal(signal.SIGINT, self._receive)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if self.before is not None:
            signal.signal(signal.SIGINT, self.before)
        if kind is None:
            self.check()

    def _receive(self, number: int, frame: FrameType | None) -> None:
        if self.received is not None:
            self.check()
        self.received = (number, frame)

    def check(self) -> None:
        if self.received is not None and self.before is not None:
            received, self.received = self.received, None
            self.before(*received)


class _Pool:
    """An executor, which is replaced when the loss of a worker has broken it."""

    def __init__(self, make: Callable[[], Executor] | None, executor: Executor | None, rows: _Rows) -> None:
        self.make, self.rows = make, rows
        self.executor: Executor | None = executor
        self.deaths: dict[tuple[int, ...], int] = {}

    def end(self) -> None:
        if self.make is not None and self.executor is not None:
            self.executor.shutdown(wait=False, cancel_futures=True)
            self.executor = None

    def run(
        self, texts: Texts, phase: int, runs: list[int], known: list[str], chunk: int | None, observe: Observe
    ) -> bool:
        with _Interrupt() as interrupt:
            return self._run(texts, phase, (runs, chunk), known, observe, interrupt)

    def _run(
        self,
        texts: Texts,
        phase: int,
        wanted: tuple[list[int], int | None],
        known: list[str],
        observe: Observe,
        interrupt: _Interrupt,
    ) -> bool:
        runs, chunk = wanted
        queue, alone, size = list(reversed(runs)), list[int](), chunk or 1
        open_: dict[Future[Any], list[int]] = {}
        single: Future[Any] | None = None
        try:
            while queue or alone or open_:
                interrupt.check()
                broken: BaseException | None = None
                while (queue or alone) and len(open_) < (1 if alone or single in open_ else TASKS):
                    # Runs that were open when a worker died are done one at a time, so that the cause of another loss is known.
                    is_single = bool(alone)
                    some = [alone.pop()] if alone else [queue.pop() for _ in range(min(size, len(queue)))]
                    try:
                        if self.executor is None:
                            assert self.make is not None
                            self.executor = self.make()
                        future = self.executor.submit(_task, texts, phase, some, known)
                        open_[future] = some
                        single = future if is_single else None
                    except BrokenExecutor as error:
                        alone.extend(reversed(some))
                        broken = error
                        break
                if broken is None:
                    done, _ = wait(open_, timeout=PAUSE, return_when=FIRST_COMPLETED)
                    for future in done:
                        some = open_.pop(future)
                        reason = CancelledError() if future.cancelled() else future.exception()
                        if reason is None:
                            taken, lines = future.result()
                            if observe(lines):
                                return True
                            if chunk is None:
                                size = max(1, min(2 * size, int(len(some) * TASK_TIME / max(taken, 1e-6))))
                        elif not _is_lost(reason):
                            raise reason
                        else:
                            self._count_loss(some, len(open_), reason)
                            alone.extend(reversed(some))
                            if isinstance(reason, BrokenExecutor):
                                broken = reason
                if broken is not None:
                    # All open tasks are lost with the pool.
                    for some in open_.values():
                        alone.extend(reversed(some))
                    open_.clear()
                    self._replace(broken)
        finally:
            for future in open_:
                future.cancel()
        return False

    def _count_loss(self, some: list[int], others: int, error: BaseException) -> None:
        """Count the loss of a worker that had one run."""
        if len(some) > 1 or (others > 0 and isinstance(error, BrokenExecutor)):
            return
        key = tuple(some)
        self.deaths[key] = self.deaths.get(key, 0) + 1
        if self.deaths[key] >= DEATHS:
            text = f"run {some[0]} has lost its worker {DEATHS} times ({type(error).__name__}: {error}); all other finished rows are kept"
            raise StudyError(text, self.rows.result()) from error

    def _replace(self, error: BaseException) -> None:
        if self.make is None:
            text = (
                "a worker died and broke the executor; finished rows are kept: call `run` again with a new executor and the same file, or "
                "with `resume=error.result`; a function that makes executors, or a number of processes, continues without that"
            )
            raise StudyError(text, self.rows.result()) from error
        if self.executor is not None:
            self.executor.shutdown(wait=False, cancel_futures=True)
        self.executor = None


def _is_lost(error: BaseException) -> bool:
    """True if an exception is that of a lost worker and not that of a task."""
    return isinstance(error, (BrokenExecutor, CancelledError, ConnectionError)) or type(error).__name__ in LOST


class StudyResult:
    """The rows of a study, and the conclusions from them."""

    def __init__(self, study: Study, lines: dict[tuple[int, int], str]) -> None:
        self._study, self._lines = study, lines
        self._found: Any = None

    @property
    def missing(self) -> int:
        """Number of runs without a row."""
        return sum(self._study.runs.values()) - len(self._lines)

    @property
    def failed(self) -> int:
        """Number of failed runs."""
        return sum('"failure":"' in line and bool(json.loads(line).get("failure")) for line in self._lines.values())

    def __len__(self) -> int:
        return len(self._lines)

    def text(self) -> str:
        """The rows as a file, with the same bytes as `rows.jsonl` of the command."""
        return self._study._core.text(list(self._lines.values()))

    def table(self, phase: str | None = None) -> dict[str, list[Any]]:
        """The rows of a phase, by default of the first one: columns by name, with `run`, `status` and `failure`."""
        phases = self._study._core.phases
        names = [row[0] for row in phases]
        if phase is not None and phase not in names:
            raise DefinitionError(f"there is no phase `{phase}`; choose from {', '.join(names)}")
        number = 0 if phase is None else names.index(phase)
        columns = phases[number][1]
        rows = [json.loads(line) for (at, _), line in self._lines.items() if at == number]
        table: dict[str, list[Any]] = {"run": [row["run"] for row in rows]}
        for k, (name, _, words) in enumerate(columns):
            values = [row["values"][k] for row in rows]
            table[name] = [words[int(v)] if v is not None else None for v in values] if words else values
        table["status"] = [row["status"] for row in rows]
        table["failure"] = [row.get("failure", "") for row in rows]
        return table

    def to_pandas(self, phase: str | None = None) -> Any:
        """The rows of a phase as a DataFrame."""
        import pandas

        return pandas.DataFrame(self.table(phase)).set_index("run")

    def _conclusions(self) -> Any:
        if self._found is None:
            self._found = self._study._core.conclude(list(self._lines.values()))
        return self._found

    @property
    def conclusions(self) -> list[str]:
        """The conclusions as sentences."""
        return list(self._conclusions()[0])

    @property
    def tables(self) -> dict[str, list[dict[str, Any]]]:
        """The tables of the conclusions by name, a dictionary for each row."""
        return {name: [json.loads(line) for line in lines] for name, lines in self._conclusions()[1]}

    @property
    def figures(self) -> dict[str, Figure]:
        """The figures of the conclusions by name."""
        return {name: Figure(name, svg) for name, _, svg in self._conclusions()[2]}

    def report(self, path: str | os.PathLike[str] | None = None) -> Page:
        """Return the report as one HTML page without external files; all runs must be done.

        Parameters
        ----------
        path : path, optional
            File to which the page is written.
        """
        page = Page(self._study._core.report(list(self._lines.values())))
        if path is not None:
            Path(path).write_text(page, encoding="utf-8")
        return page

    def _repr_html_(self) -> str:
        if self.missing:
            return f"<p>{html.escape(repr(self))}</p>"
        sentences = "".join(f"<p>{html.escape(sentence)}</p>" for sentence in self.conclusions)
        return sentences + "".join(figure.svg for figure in self.figures.values())

    def __repr__(self) -> str:
        return f"<StudyResult: {len(self)} rows, {self.failed} failed, {self.missing} missing>"


__all__ = ["Study", "StudyError", "StudyResult"]
