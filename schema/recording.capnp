# The file that `mpf tap --write` writes and `mpf replay` sends again: Records, each in a standard
# Cap'n Proto stream frame. `capnp decode recording.capnp Record --short <file` shows it. New fields
# are added at the end; published numbers never change.
@0xb077ea0582919f50;

using Cxx = import "/capnp/c++.capnp";
using Message = import "message.capnp";
$Cxx.namespace("mpf::wire");

enum Direction {
  request @0;  # client to server
  reply @1;
}

struct Record {
  atNs @0 :Int64;   # CLOCK_REALTIME when the message was read from the ring
  link @1 :UInt64;  # incarnation of the link
  union {
    opened :group {         # the first record of a link
      server @2 :Text;
      location @3 :Int32;
      client @4 :Text;      # label or program
      clientPid @5 :Int32;  # 0: the client had exited already
    }
    message :group {
      direction @6 :Direction;
      requestId @7 :UInt32;
      isFirstReply @8 :Bool;     # the reply ends its request
      mayHaveChanged @9 :Bool;   # read after the receiver, which may write to it, had taken it
      envelope @10 :Message.Envelope;
    }
    unreadable :group {     # a message that could not be decoded
      direction @11 :Direction;
      requestId @12 :UInt32;
      problem @13 :Text;
    }
    missed @14 :UInt64;     # total of the messages of this link that were not read
    closed @15 :Void;       # the last record of the link
  }
}
