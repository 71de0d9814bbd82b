// SPDX-License-Identifier: MIT
// UserBuilder, UserReader: build and read a UserMessage, which carries a Cap'n Proto struct of the
// user's own schema in standard segment framing.
//
//   | User | segment table (1 word) | segment |   MPF and its routers do not interpret these bytes
//
//   mpf::UserBuilder builder(client.alloc<mpf::User>(4096));    // [bytes], in shared memory
//   builder.initRoot<Spectrum>().setGain(3);
//   const auto result = client.send(std::move(builder).finish());
//
//   mpf::UserReader reader(message);
//   auto spectrum = reader.getRoot<Spectrum>();
//
// Threads  one thread at a time uses a builder or a reader.
// Trust    Cap'n Proto checks what it reads, but a peer may change the bytes after the check: read
//          a duplicate() of a message from a peer that is not trusted.
// Source   an addition; the manual has no such type ("Adding New Message Types").
#pragma once

#include <capnp/message.h>
#include <capnp/serialize.h>

#include <mpf/message_of.h>

namespace mpf {

// Builds in place, in one segment, in the memory of the message, which it owns.
//   throws  kj::Exception from initRoot() and from setters of the struct when the message is full
class UserBuilder {
 public:
  // Fills the memory of the message with zeroes, as Cap'n Proto requires.
  //   message   its size is the room for the segment table (8 bytes) and the segment
  //   throws    kj::Exception if that is less than 16 bytes
  explicit UserBuilder(UserMessage message);

  // The struct to fill in. Its builder is valid until finish().
  template <class Root>
  typename Root::Builder initRoot() {
    return builder_.initRoot<Root>();
  }
  // Returns the message, with the size that the struct uses, ready to be sent.
  //   throws  kj::Exception before initRoot()
  [[nodiscard]] UserMessage finish() &&;

 private:
  UserMessage message_;
  capnp::FlatMessageBuilder builder_;
};

// Copies a Cap'n Proto message of any number of segments into a UserMessage on the heap.
//   throws  std::bad_alloc
[[nodiscard]] UserMessage toUserMessage(capnp::MessageBuilder& builder);

// Reads in place and copies nothing. The UserMessage must outlive this object and what it returns.
//   limits   of Cap'n Proto: how much is read and how deep structs are nested
//   throws   kj::Exception, here or from getters, when the bytes are not a Cap'n Proto message
class UserReader : public capnp::FlatArrayMessageReader {
 public:
  explicit UserReader(const UserMessage& message, capnp::ReaderOptions limits = {});
};

}  // namespace mpf
