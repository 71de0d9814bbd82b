# The items of a router of a later minor version: router.capnp and message.capnp with additional
# fields, items and message types. Unchanged structs are declared only where a union refers to them.
@0xb1d7c2f5a8e3940d;

using Cxx = import "/capnp/c++.capnp";
$Cxx.namespace("mpf::newer");

struct Frame {
  items @0 :List(Item);
  sentAtNs @1 :UInt64;  # new
}

struct Item {
  union {
    none @0 :Void;
    greeting @1 :Greeting;
    farewell @2 :AnyPointer;
    ping @3 :Ping;
    pong @4 :Ping;
    bind @5 :AnyPointer;
    unbind @6 :UInt32;
    server @7 :AnyPointer;
    open @8 :AnyPointer;
    close @9 :UInt32;
    refuse @10 :AnyPointer;
    request @11 :Request;
    reply @12 :Reply;
    fate @13 :AnyPointer;
    queueFull @14 :UInt32;
    credit @15 :AnyPointer;
    weather @16 :Text;  # new
    moon @17 :UInt64;   # new
  }
  urgency @18 :Float64;  # new
}

struct Greeting {
  protocolMajor @0 :UInt16;
  protocolMinor @1 :UInt16;
  router @2 :Text;
  program @3 :Text;
  incarnation @4 :UInt64;
  locations @5 :List(Int32);
  maxFrameBytes @6 :UInt64;
  maxMessageBytes @7 :UInt64;
  deadTimeMs @8 :UInt32;
  maxClients @9 :UInt32;
  features @10 :List(Text);  # new
  timeZone @11 :Int16;       # new
}

# The greeting of an earlier version, without deadTimeMs and maxClients.
struct OlderFrame {
  items @0 :List(OlderItem);
}

struct OlderItem {
  union {
    none @0 :Void;
    greeting @1 :OlderGreeting;
  }
}

struct OlderGreeting {
  protocolMajor @0 :UInt16;
  protocolMinor @1 :UInt16;
  router @2 :Text;
  program @3 :Text;
  incarnation @4 :UInt64;
  locations @5 :List(Int32);
  maxFrameBytes @6 :UInt64;
  maxMessageBytes @7 :UInt64;
}

struct Ping {
  stamp @0 :UInt64;
  reason @1 :Text;  # new
}

struct Request {
  client @0 :UInt32;
  requestId @1 :UInt32;
  takeWithinNs @2 :UInt64;
  message @3 :Envelope;
  priority @4 :UInt8;  # new
}

struct Reply {
  client @0 :UInt32;
  requestId @1 :UInt32;
  isFirst @2 :Bool;
  message @3 :Envelope;
  missed @4 :UInt32;
  tookNs @5 :UInt64;  # new
}

struct Envelope {
  clientType @0 :Int32;
  clientExtra @1 :Int32;
  union {
    connect @2 :AnyPointer;
    int32 @3 :Int32Value;
    int32Array @4 :AnyPointer;
    float64 @5 :AnyPointer;
    float64Array @6 :AnyPointer;
    char8Array @7 :AnyPointer;
    serialConfig @8 :AnyPointer;
    outOfBand @9 :AnyPointer;
    requestFate @10 :AnyPointer;
    user @11 :AnyPointer;
    colour @12 :Colour;  # new
  }
  trace @13 :UInt64;  # new
}

struct Int32Value {
  timeout @0 :Int32;
  cmd @1 :Int32;
  status @2 :Int32;
  address @3 :Int32;
  extra @4 :Int32;
  value @5 :Int32;
  unit @6 :Text;  # new
}

struct Colour {
  red @0 :Float64;
  names @1 :List(Text);
}
