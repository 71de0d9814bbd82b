// SPDX-License-Identifier: MIT
// UserBuilder, UserReader: build and read a UserMessage, which has a Cap'n Proto struct of the
// user's own schema in standard segment framing.
//
//   | User | segment table (1 word) | segment |          MPF and its routers forward these bytes unread
//
//   mpf::UserBuilder builder(mpf::UserMessage::allocValue(4096));      // or in a link's pool:
//   UserMessage::inBuffer builder.initRoot<Spectrum>().setGain(3);
//   client.send(std::move(builder).finish());
//
//   mpf::UserReader reader(message);
//   auto spectrum = reader.getRoot<Spectrum>();
//
// Threads  one at a time.
// Trust    Cap'n Proto checks what it reads, but a peer may change the bytes after the check: read
//          a duplicate() of a message from a peer that is not trusted.
#pragma once

#include <capnp/message.h>
#include <capnp/serialize.h>

#include <mpf/message_of.h>

namespace mpf {

// Builds in place, in one segment. A setter throws kj::Exception when the message has no room.
class UserBuilder {
 public:
  // Fills the memory of the message with zeroes, as Cap'n Proto requires.
  explicit UserBuilder(UserMessage message);

  template <class Root>
  typename Root::Builder initRoot() {
    return builder_.initRoot<Root>();
  }
  // Returns the message, with the size that was used. The builders of its structs are invalid
  // afterwards.
  [[nodiscard]] UserMessage finish() &&;

 private:
  UserMessage message_;
  capnp::FlatMessageBuilder builder_;
};

// Copies any Cap'n Proto message into a UserMessage on the heap.
[[nodiscard]] UserMessage toUserMessage(capnp::MessageBuilder& builder);

// Reads in place. The UserMessage must outlive this object.
//   throws  kj::Exception when the bytes are not a Cap'n Proto message
class UserReader : public capnp::FlatArrayMessageReader {
 public:
  explicit UserReader(const UserMessage& message, capnp::ReaderOptions limits = {});
};

}  // namespace mpf
