"""``python -m trueup``: the command line."""

import signal
import sys

from . import _trueup


def main() -> int:
    """Run the command line with the arguments of this process; give its exit code."""
    sys.stdout.flush()
    sys.stderr.flush()
    # Without this Ctrl-C would wait for Python, which waits for the command.
    if hasattr(signal, "SIGINT"):
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _trueup.main(["trueup", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
