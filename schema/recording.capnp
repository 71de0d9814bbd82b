# What `mpf tap --write` keeps and `mpf replay` sends again: a file of Records, one standard Cap'n Proto stream frame each.
# `capnp decode recording.capnp Record --short <file` shows it. New fields are added at the end; published numbers never change.
@0xb077ea0582919f50;

using Cxx = import "/capnp/c++.capnp";
using Message = import "message.capnp";
$Cxx.namespace("mpf::wire");

enum Direction {
  request @0;  # client to server
  reply @1;
}

struct Record {
  atNs @0 :Int64;   # CLOCK_REALTIME when it was read from the ring
  link @1 :UInt64;  # incarnation of the link that it is about
  union {
    opened :group {         # before everything else about a link
      server @2 :Text;
      location @3 :Int32;
      client @4 :Text;      # label or program
      clientPid @5 :Int32;  # 0: it was gone already
    }
    message :group {
      direction @6 :Direction;
      requestId @7 :UInt32;
      isFirstReply @8 :Bool;     # it ends its request
      mayHaveChanged @9 :Bool;   # read when its receiver, who may write into it, had it already
      envelope @10 :Message.Envelope;
    }
    unreadable :group {     # a message of which there is no more to tell
      direction @11 :Direction;
      requestId @12 :UInt32;
      problem @13 :Text;
    }
    missed @14 :UInt64;     # messages of this link that were not read so far, in all
    closed @15 :Void;       # nothing else comes about this link
  }
}
