# SPDX-License-Identifier: MIT
"""MPF: message passing for hosts that control instruments.

    import mpf

    with mpf.Client("dac") as dac:
        print(dac.int32(address=3, value=100).value)

`Client` and `AsyncClient` send requests to a server, `Server` answers them. The classes of messages
are `Int32`, `Int32Array`, `Float64`, `Float64Array`, `Char8Array`, `SerialConfig`, `OutOfBand` and
`User`. `Serial` and `Gpib` are instruments behind the servers of such lines. `servers()`, `stats()`
and `tap()` show what happens on this host; `record()` writes it to a file, and `replay()` starts a
server that replies as in that file.
"""

try:
    from mpf._mpf import (
        Char8Array,
        Float64,
        Float64Array,
        Int32,
        Int32Array,
        Message,
        OutOfBand,
        Request,
        SerialConfig,
        User,
        version,
    )
except ImportError as error:  # its cause is the reason, for example a sub-interpreter
    raise error.__cause__ or error
from mpf.aio import AsyncClient
from mpf.aio_requests import AsyncRequest, AsyncSubscription
from mpf.client import Client
from mpf.errors import (
    Cancelled,
    Error,
    Expired,
    InstrumentError,
    InstrumentTimeout,
    NameInUse,
    NeverTaken,
    NoReply,
    NotConnected,
    NotSent,
    OutcomeUnknown,
    QueueFull,
    Refused,
    StatusError,
    TimedOut,
    TooLarge,
    UnexpectedReply,
)
from mpf.inspection import Ghost, Recording, Running, Tap, record, replay, servers, stats, tap
from mpf.instruments import Gpib, Instrument, Serial
from mpf.server import Server
from mpf.subscription import Subscription

#: The version of this package, as of the programs of MPF.
__version__: str = version

__all__ = [
    "AsyncClient",
    "AsyncRequest",
    "AsyncSubscription",
    "Cancelled",
    "Char8Array",
    "Client",
    "Error",
    "Expired",
    "Float64",
    "Float64Array",
    "Ghost",
    "Gpib",
    "Instrument",
    "InstrumentError",
    "InstrumentTimeout",
    "Int32",
    "Int32Array",
    "Message",
    "NameInUse",
    "NeverTaken",
    "NoReply",
    "NotConnected",
    "NotSent",
    "OutOfBand",
    "OutcomeUnknown",
    "QueueFull",
    "Recording",
    "Refused",
    "Request",
    "Running",
    "Serial",
    "SerialConfig",
    "Server",
    "StatusError",
    "Subscription",
    "Tap",
    "TimedOut",
    "TooLarge",
    "UnexpectedReply",
    "User",
    "record",
    "replay",
    "servers",
    "stats",
    "tap",
]
