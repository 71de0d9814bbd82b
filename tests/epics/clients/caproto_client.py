# SPDX-License-Identifier: MIT
"""caproto_client.py get|put|monitor RECORD [VALUE]: a client of Channel Access with caproto, an
implementation of the protocol in Python alone. Output as of libca_client.cpp."""
import sys
import threading

from caproto import CaprotoTimeoutError
from caproto.threading.client import Context

# Of one attempt: caproto was seen to wait forever, on a machine with much load, for a record whose
# connection ended before it was used. There is no limit for all attempts: the test has a watchdog.
TIMEOUT = 30


def show(response):
    print(int(response.data[0]), int(response.metadata.severity), file=sys.stderr, flush=True)


# A function of the module: caproto keeps a weak reference only.
def on_update(_, response):
    show(response)


def attempt(command, name, value):
    (record,) = Context(timeout=TIMEOUT).get_pvs(name, timeout=TIMEOUT)
    record.wait_for_connection(timeout=TIMEOUT)
    if command == "get":
        show(record.read(data_type="time", timeout=TIMEOUT))
    elif command == "put":
        record.write([int(value)], wait=True, timeout=TIMEOUT)
    elif command == "monitor":
        subscription = record.subscribe(data_type="time")
        subscription.add_callback(on_update)
        threading.Event().wait()


def main(command, name, value=None):
    while True:
        try:
            return attempt(command, name, value)
        except (CaprotoTimeoutError, TimeoutError) as error:
            print(f"again: {error}", flush=True)


main(*sys.argv[1:])
