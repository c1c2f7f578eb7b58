"""What nacre runs on."""

from nacre import _core

__version__ = _core.__version__


def instruction_set() -> str:
    """Return the instruction set whose kernels run.

    Returns
    -------
    str
        ``"baseline"``, ``"avx2"`` (x86-64-v3) or ``"avx512"`` (x86-64-v4): the best that the processor has,
        or the one that the environment variable ``NACRE_SIMD`` named when it was first needed.

    Raises
    ------
    RuntimeError
        When ``NACRE_SIMD`` is none of these, or not in the processor.
    """
    return _core.instruction_set()


def default_threads() -> int:
    """Return how many threads ``num_threads=0`` means.

    Returns
    -------
    int
        ``OMP_NUM_THREADS`` of the environment where it was set when nacre first needed threads, else the
        number of processors that the process may run on.
    """
    return _core.default_threads()


def parallel_backend() -> str:
    """Return what lends threads to nacre's loops, chosen when it was built.

    Returns
    -------
    str
        ``"threads"``, a pool of nacre's own, as in all wheels; or ``"openmp"``.
    """
    return _core.parallel_backend()
