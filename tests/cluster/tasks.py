"""What workers are given to do; nothing is imported here that takes time, for each of them does."""

import os
import signal


def threads(names):
    """The process and its values of environment variables."""
    return os.getpid(), [os.environ[name] for name in names]


def die_once(marker):
    """Ends the process in the midst of the work, the first time."""
    if not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return marker.name


def die(_):
    os._exit(1)
