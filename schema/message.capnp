# The message types of MPF as they travel to another host. In shared memory they are the plain structs of message_types.h, whose
# descriptions name these fields; a test compares the two. Numbers (@n) of published fields never change; new fields are added at the end.
@0xd3a1c6f8b0e24795;

using Cxx = import "/capnp/c++.capnp";
$Cxx.namespace("mpf::wire");

# One message with what every message has. The members of the union stand in the order of mpf::MessageType, from connect = 1 on:
# a reader that meets a discriminant it does not know has met a newer peer.
struct Envelope {
  clientType @0 :Int32;   # whatever the client put there; copied into the replies
  clientExtra @1 :Int32;
  union {
    connect @2 :Connect;
    int32 @3 :Int32Value;
    int32Array @4 :Int32Array;
    float64 @5 :Float64Value;
    float64Array @6 :Float64Array;
    char8Array @7 :Char8Array;
    serialConfig @8 :SerialConfig;
    outOfBand @9 :OutOfBand;
    requestFate @10 :RequestFate;
    user @11 :User;
  }
}

enum ConnectStatus {
  connectNo @0;         # no server, or it went away
  connectYes @1;
  connectQueueFull @2;  # the server's queue was full: a message was refused, the connection stands
  connectRefused @3;    # the server is there and does not want this client
}

struct Connect {
  status @0 :ConnectStatus;
  incarnation @1 :UInt64;  # which life of the server this is about; another number means that it was restarted
}

# timeout, cmd, status, address and extra are the standard fields: client and server agree on what they mean.
struct Int32Value {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :Int32;
}

struct Int32Array {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :List(Int32);
}

struct Float64Value {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :Float64;
}

struct Float64Array {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :List(Float64);
}

struct Char8Array {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  numberRetrys @5 :Int32;  # sic
  eomLen @6 :Int32;
  eomString @7 :Data;      # at most 4 bytes, of which eomLen count
  value @8 :Data;
}

struct SerialConfig {  # 0: leave as it is
  baud @0 :Int32;
  stopBits @1 :Int32;
  bitsPerChar @2 :Int32;
  parity @3 :UInt8;       # 'E', 'O', 'N'
  flowControl @4 :UInt8;  # 'H', 'N'
}

struct OutOfBand {  # from a server to a client, in answer to nothing
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :Int32;
}

enum Fate {
  refused @0;
  neverTaken @1;
  outcomeUnknown @2;
  expired @3;
  cancelled @4;
}

struct RequestFate {
  fate @0 :Fate;
  requestId @1 :UInt32;
}

struct User {
  value @0 :Data;  # a whole Cap'n Proto message of the user's own schema, in standard segment framing
}
