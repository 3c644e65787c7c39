"""Optional packages that cannot be imported: absent or broken, and what mends each."""

from __future__ import annotations


def how_to_mend(package: str, extra: str, error: Exception) -> str:
    """Return what is wrong with a package, and the command: an absent one is installed, a broken one anew.

    ``package``: its distribution, which begins with the name of its module; ``extra``: of seatfem, "" of what is always
    needed; ``error``: that importing it raised.
    """
    of_extra = f"seatfem[{extra}]" if extra else package
    module = (getattr(error, "name", None) or "").partition(".")[0]
    if isinstance(error, ModuleNotFoundError) and module in ("", package, package.replace("-", "_")):
        return f"{package} is not installed; install it with: pip install '{of_extra}'"
    whose = f"{package} (extra {extra!r})" if extra else package
    reason = " ".join(str(error).split()) or type(error).__name__
    command = f"pip install --force-reinstall {package}"
    return f"{whose} is installed but cannot be imported ({reason}); install it anew: {command}"
