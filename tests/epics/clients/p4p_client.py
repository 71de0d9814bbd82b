# SPDX-License-Identifier: MIT
"""p4p_client.py get|put|monitor RECORD [VALUE]: a client of pvAccess with p4p. Output as of
libca_client.cpp."""
import sys
import threading

from p4p.client.thread import Context

NO_LIMIT = None  # the test has a watchdog


def show(value):
    print(int(value), value.severity, file=sys.stderr, flush=True)


def main(command, name, value=None):
    with Context("pva") as context:
        if command == "get":
            show(context.get(name, timeout=NO_LIMIT))
        elif command == "put":
            context.put(name, int(value), wait=True, timeout=NO_LIMIT)
        elif command == "monitor":
            subscription = context.monitor(name, show)
            threading.Event().wait()
            subscription.close()


main(*sys.argv[1:])
