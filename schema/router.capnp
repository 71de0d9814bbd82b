# The protocol between two routers over one TCP connection, with or without TLS. docs/wire-format.md
# says when each item is sent and what each side must do.
#
# The side that connected is the client router: it has clients. The side that accepted is the server
# router: it has servers. Each side sends Frames, each in a standard Cap'n Proto stream frame, not
# packed. The first Frame of each side has its greeting and nothing else.
#
# Versions: routers of different major versions end the connection after the greeting. Within a
# major version new fields and new kinds of items are added at the end; a reader ignores an item of
# an unknown kind. Published numbers never change.
@0xe5b2d0a94c7f1683;

using Cxx = import "/capnp/c++.capnp";
using Message = import "message.capnp";
$Cxx.namespace("mpf::wire");

const protocolMajor :UInt16 = 1;
const protocolMinor :UInt16 = 0;

struct Frame {
  items @0 :List(Item);  # in the order in which they happened
}

struct Item {
  union {
    none @0 :Void;          # no content; a sign of life, as every frame is
    greeting @1 :Greeting;  # sent by both, first
    farewell @2 :Farewell;  # sent by both, last
    ping @3 :Ping;          # sent by both
    pong @4 :Ping;          # sent by both: the answer to a ping, with the same stamp

    bind @5 :Bind;          # client router: asks for the state of a server and its changes
    unbind @6 :UInt32;      # client router: closes a binding (its number) and all its clients
    server @7 :Server;      # server router: the state of the server of a binding

    open @8 :Open;          # client router: opens a client of a binding
    close @9 :UInt32;       # client router: closes a client (its number)
    refuse @10 :Refusal;
    # server router: the server does not accept the client; all its requests end as refused

    request @11 :Request;   # client router
    reply @12 :Reply;       # server router
    fate @13 :RequestEnd;   # server router: ends a request that gets no reply
    queueFull @14 :UInt32;
    # server router: a request of this client was refused, because the server's queue was full
    credit @15 :Credit;     # client router: bytes of replies that the client has taken
  }
}

struct Greeting {
  protocolMajor @0 :UInt16;
  protocolMinor @1 :UInt16;
  router @2 :Text;            # the name of the sender, for people
  program @3 :Text;           # "mpf-router 0.1.0"
  incarnation @4 :UInt64;     # identifies one run of the sender
  locations @5 :List(Int32);  # server router: the locations that it serves
  maxFrameBytes @6 :UInt64;   # the longest frame that the sender reads, segment table included
  maxMessageBytes @7 :UInt64; # the largest body of a message that the sender accepts
  deadTimeMs @8 :UInt32;      # the sender ends a connection that is silent for this time
  maxClients @9 :UInt32;      # server router: clients that may be open at once
}

struct Farewell {
  reason @0 :Text;  # for people
  code @1 :Code;
  enum Code {
    stopping @0;     # the router exits, or its configuration no longer names the peer
    version @1;      # another major version
    protocol @2;     # the peer sent invalid data
    limit @3;        # the peer sent more than the greeting allows
    silence @4;      # the peer was silent for too long
    notAllowed @5;   # this peer may not connect
  }
}

struct Ping {
  stamp @0 :UInt64;  # chosen by the sender
}

struct Bind {
  binding @0 :UInt32;  # a new number, chosen by the client router
  location @1 :Int32;
  server @2 :Text;     # 1 to 63 bytes
}

struct Server {
  binding @0 :UInt32;
  state @1 :State;
  incarnation @2 :UInt64;      # there: identifies one run of the server
  queueSize @3 :UInt32;        # there: most requests of one client that wait to be taken
  maxMessageBytes @4 :UInt64;  # there: limit of a request or a reply
  reason @5 :Text;             # absent, refused: the reason, for people
  maxOutstanding @6 :UInt32;   # there: most unanswered requests of one client
  hops @7 :UInt16;
  # there: further connections between routers over which the server router reaches the server; 0:
  # the server runs on its host
  enum State {
    absent @0;   # closes all clients of the binding; `server` follows again when the state changes
    there @1;
    refused @2;  # this peer may not bind to the server; closes the binding
  }
}

struct Open {
  client @0 :UInt32;   # a new number, chosen by the client router
  binding @1 :UInt32;
  incarnation @2 :UInt64;
  # of the server; if another one is running by now, each request ends as neverTaken
  window @3 :UInt32;       # bytes of replies that may be under way; see Credit
}

struct Refusal {
  client @0 :UInt32;
  reason @1 :Text;  # for people
}

struct Request {
  client @0 :UInt32;
  requestId @1 :UInt32;       # not 0; docs/wire-format.md says which ids are valid together
  takeWithinNs @2 :UInt64;
  # not 0: a request that the server has not taken within this time ends as expired
  message @3 :Message.Envelope;
}

struct Reply {
  client @0 :UInt32;
  requestId @1 :UInt32;
  isFirst @2 :Bool;  # ends the request; each request ends in exactly one reply or fate
  message @3 :Message.Envelope;
  missed @4 :UInt32;
  # further replies to this request that were dropped since the last reply that was sent to it,
  # because they were not taken fast enough
}

struct RequestEnd {
  client @0 :UInt32;
  requestId @1 :UInt32;
  fate @2 :Message.Fate;
  reason @3 :Text;  # for people; may be empty
}

struct Credit {
  client @0 :UInt32;
  bytes @1 :UInt32;
}
