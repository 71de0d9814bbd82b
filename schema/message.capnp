# The message types of MPF as they are sent to another host. In shared memory they are the plain
# structs of message_types.h, whose descriptions use the same field names; a test compares the two.
# Numbers (@n) of published fields never change; new fields are added at the end.
@0xd3a1c6f8b0e24795;

using Cxx = import "/capnp/c++.capnp";
$Cxx.namespace("mpf::wire");

# One message with the fields that every message has. The members of the union are in the order of
# mpf::MessageType, from connect = 1 on. An unknown discriminant comes from a newer peer.
struct Envelope {
  clientType @0 :Int32;   # set by the client; copied into the replies
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
  timeStampNs @12 :Int64;  # of a reply: CLOCK_REALTIME of its data; 0: the server did not say
}

enum ConnectStatus {
  connectNo @0;         # no server, or the server is gone
  connectYes @1;
  connectQueueFull @2;  # the server's queue was full: a message was refused; still connected
  connectRefused @3;    # the server does not accept this client
}

struct Connect {
  status @0 :ConnectStatus;
  incarnation @1 :UInt64;  # identifies one run of the server; it changes when the server restarts
}

# timeout, cmd, status, address and extra are the standard fields: client and server agree on their
# meaning.
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
  eomString @7 :Data;      # at most 4 bytes; the first eomLen of them are used
  value @8 :Data;
}

struct SerialConfig {  # 0 in a field: keep the setting
  baud @0 :Int32;
  stopBits @1 :Int32;
  bitsPerChar @2 :Int32;
  parity @3 :UInt8;       # 'E', 'O', 'N'
  flowControl @4 :UInt8;  # 'H', 'N'
}

struct OutOfBand {  # from a server to a client, without a request
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
  value @0 :Data;
  # A complete Cap'n Proto message of the user's own schema, in standard segment framing.
}
