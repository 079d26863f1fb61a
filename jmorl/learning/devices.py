"""Setting JAX up before its first use: CPU cores as devices, a compilation cache on disk, and whether it works."""

import os
from contextlib import suppress
from pathlib import Path

import jax

START = ("JAX_PLATFORMS", "JAX_NUM_CPU_DEVICES", "CUDA_VISIBLE_DEVICES")  # what decides about the devices


class NoDevices(RuntimeError):
    """JAX has nothing to compute on, as it is set."""


def usable_cores() -> int:
    """How many CPU cores this process may use; where the system does not say, those of the machine."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def cache_folder() -> Path | None:
    """Return the folder for compiled programs, which is made; None where this user has no folder for caches.

    It is below XDG_CACHE_HOME; that is ignored, as its standard says, if it is not an absolute path.
    """
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    try:
        folder = (given if given.is_absolute() else Path.home() / ".cache") / "jmorl" / "jax"
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # it cannot be made; there is no home folder
        return None
    return folder if os.access(folder, os.W_OK) else None


def use_all_cpu_cores() -> None:
    """Make every CPU core this process may use a JAX device, and keep compiled programs on disk.

    Call it before JAX is first used; a program that has already used JAX keeps the devices it has. Settings
    made through JAX's own environment variables are left alone.
    """
    if "JAX_NUM_CPU_DEVICES" not in os.environ:
        with suppress(RuntimeError):  # JAX has been used
            jax.config.update("jax_num_cpu_devices", usable_cores())
    cache = cache_folder()
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ and cache:
        jax.config.update("jax_compilation_cache_dir", str(cache))
    if "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS" not in os.environ:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.5)


def check_devices() -> None:
    """Start JAX. Raises NoDevices if it has no device to compute on."""
    try:
        jax.devices()
    except Exception as error:  # of several kinds, without a message if a platform that is asked for is not there
        values = [f"{name}={os.environ[name]}" for name in START if name in os.environ]
        asked = f" with {', '.join(values)}" if values else ""
        said = str(error) or "there is no such device here"
        raise NoDevices(f"JAX cannot start{asked}: {said}") from error
