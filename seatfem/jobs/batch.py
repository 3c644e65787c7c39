"""Many jobs carried out by processes of this computer: one that hangs or crashes ends as its own outcome alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager

from seatfem.jobs.desk import Ask, Desk, Lost, Program
from seatfem.jobs.folders import private_folder


@contextmanager
def crew(program: Program, *, workers: int) -> Iterator[Ask]:
    """Start several workers, which stay from one batch of jobs to the next.

    The jobs of a batch are begun in their order, and their answers come as they are there. Each worker starts when it
    is needed, by the thread that asks.
    """
    purpose = program.module.rpartition(".")[0].rpartition(".")[2]
    with private_folder(purpose) as folder, ThreadPoolExecutor(max(workers, 1)) as threads, ExitStack() as ours:
        desks = [Desk(program, folder / str(number)) for number in range(workers)]
        for desk in desks:
            ours.callback(desk.end)

        def ask(jobs: Iterable[str], limit: float) -> Iterator[tuple[int, str | Lost]]:
            waiting, pending = iter(enumerate(jobs)), dict[Future[str | Lost], tuple[Desk, int]]()

            def hand_out(desk: Desk) -> None:
                for number, job in waiting:
                    desk.start()
                    pending[threads.submit(desk.answer, job, limit)] = desk, number
                    return

            for desk in desks:
                hand_out(desk)
            while pending:
                ended, _ = wait(pending, return_when=FIRST_COMPLETED)
                for future in ended:
                    desk, number = pending.pop(future)
                    answer = future.result()
                    desk.renewed(answer)
                    yield number, answer
                    hand_out(desk)

        yield ask
