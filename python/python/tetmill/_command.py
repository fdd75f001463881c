"""The command `tetmill`."""

import signal
import sys

from . import _native


def main() -> int:
    """Run the command line with the arguments of this process, and return its exit status."""
    # The command has a handler of its own, which it installs in place of the default action only.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_command(sys.argv)


if __name__ == "__main__":
    sys.exit(main())
