# What routers say to each other over one TCP connection (or TLS over it). docs/wire-format.md says when, and what each side must do.
#
# The side that connected is the client router: it has clients. The side that accepted is the server router: it has servers.
# Each side sends Frames, one standard Cap'n Proto stream frame each, unpacked. The first one of each side holds its greeting and nothing else.
#
# Versions: the same major version, or the greeting ends the connection. Within it new fields and new kinds of items are added at the
# end; a reader ignores an item whose kind it does not know. Published numbers never change.
@0xe5b2d0a94c7f1683;

using Cxx = import "/capnp/c++.capnp";
using Message = import "message.capnp";
$Cxx.namespace("mpf::wire");

const protocolMajor :UInt16 = 1;
const protocolMinor :UInt16 = 0;

struct Frame {
  items @0 :List(Item);  # in order; what happened first stands first
}

struct Item {
  union {
    none @0 :Void;          # nothing; says that its sender lives, as every frame does
    greeting @1 :Greeting;  # both, first
    farewell @2 :Farewell;  # both, last
    ping @3 :Ping;          # both
    pong @4 :Ping;          # both: a ping sent back as it was

    bind @5 :Bind;          # client router: tell me of this server
    unbind @6 :UInt32;      # client router: binding; no more of it, all its clients are gone
    server @7 :Server;      # server router: the server of a binding is there, or not

    open @8 :Open;          # client router: one more client of a binding
    close @9 :UInt32;       # client router: client; it is gone
    refuse @10 :Refusal;    # server router: the client cannot be; each of its requests will end as refused

    request @11 :Request;   # client router
    reply @12 :Reply;       # server router
    fate @13 :RequestEnd;   # server router: a request that gets no reply
    queueFull @14 :UInt32;  # server router: client; a request of it found the server's queue full, and ends as refused
    credit @15 :Credit;     # client router: so much of the replies was taken
  }
}

struct Greeting {
  protocolMajor @0 :UInt16;
  protocolMinor @1 :UInt16;
  router @2 :Text;            # what people call the sender
  program @3 :Text;           # "mpf-router 0.1.0"
  incarnation @4 :UInt64;     # which life of the sender
  locations @5 :List(Int32);  # server router: those that it serves
  maxFrameBytes @6 :UInt64;   # the longest frame that the sender of this reads, with its segment table
  maxMessageBytes @7 :UInt64; # the largest body of a message that it takes
  deadTimeMs @8 :UInt32;      # it cuts a connection on which it hears nothing for so long
  maxClients @9 :UInt32;      # server router: clients that may be open at once
}

struct Farewell {
  reason @0 :Text;  # for people
  code @1 :Code;
  enum Code {
    stopping @0;     # the router ends, or its configuration does not name the peer any more
    version @1;      # another major version
    protocol @2;     # the peer sent what cannot be
    limit @3;        # the peer sent more than the greeting allows
    silence @4;      # the peer was not heard of for too long
    notAllowed @5;   # this peer may not connect
  }
}

struct Ping {
  stamp @0 :UInt64;  # the sender's own
}

struct Bind {
  binding @0 :UInt32;  # a new number, chosen by the client router
  location @1 :Int32;
  server @2 :Text;     # 1 to 63 bytes
}

struct Server {
  binding @0 :UInt32;
  state @1 :State;
  incarnation @2 :UInt64;      # there: which life of the server
  queueSize @3 :UInt32;        # there: requests of one client that may wait
  maxMessageBytes @4 :UInt64;  # there: of a request or a reply
  reason @5 :Text;             # absent, refused: why, for people
  maxOutstanding @6 :UInt32;   # there: requests of one client that may be unanswered
  enum State {
    absent @0;   # not there; `server` comes again when that changes. All its clients are closed by this
    there @1;
    refused @2;  # this peer may not bind to it; the binding is closed by this
  }
}

struct Open {
  client @0 :UInt32;   # a new number, chosen by the client router
  binding @1 :UInt32;
  incarnation @2 :UInt64;  # of the server that it is meant for; if that is another one by now, it is closed as if it had gone
  window @3 :UInt32;       # bytes of replies that may be on their way; see Credit
}

struct Refusal {
  client @0 :UInt32;
  reason @1 :Text;  # for people
}

struct Request {
  client @0 :UInt32;
  requestId @1 :UInt32;       # not 0; differs from those of unanswered requests modulo the power of two from Server.maxOutstanding on
  takeWithinNs @2 :UInt64;    # not 0: a request that the server has not taken by then ends as expired
  message @3 :Message.Envelope;
}

struct Reply {
  client @0 :UInt32;
  requestId @1 :UInt32;
  isFirst @2 :Bool;  # it ends the request; of each request exactly one reply or fate does
  message @3 :Message.Envelope;
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
