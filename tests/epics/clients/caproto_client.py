# SPDX-License-Identifier: MIT
"""caproto_client.py get|put|monitor RECORD [VALUE]: a client of Channel Access with caproto, an
implementation of the protocol in Python alone. Output as of libca_client.cpp."""
import sys
import threading

from caproto.threading.client import Context

NO_LIMIT = None  # the test has a watchdog


def show(response):
    print(int(response.data[0]), int(response.metadata.severity), file=sys.stderr, flush=True)


# A function of the module: caproto keeps a weak reference only.
def on_update(_, response):
    show(response)


def main(command, name, value=None):
    (record,) = Context(timeout=NO_LIMIT).get_pvs(name, timeout=NO_LIMIT)
    record.wait_for_connection(timeout=NO_LIMIT)
    if command == "get":
        show(record.read(data_type="time", timeout=NO_LIMIT))
    elif command == "put":
        record.write([int(value)], wait=True, timeout=NO_LIMIT)
    elif command == "monitor":
        subscription = record.subscribe(data_type="time")
        subscription.add_callback(on_update)
        threading.Event().wait()


main(*sys.argv[1:])
