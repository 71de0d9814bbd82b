// SPDX-License-Identifier: MIT
// User messages: a Cap'n Proto struct of the user's own schema, in standard segment framing, inside a UserMessage.
//
//   | User | segment table (1 word) | segment |          MPF and its routers forward these bytes and never look inside
//
//   mpf::UserBuilder builder(mpf::UserMessage::allocValue(4096));      // or in a link's pool: UserMessage::inBuffer
//   builder.initRoot<Spectrum>().setGain(3);
//   client.send(std::move(builder).finish());
//
//   mpf::UserReader reader(message);
//   auto spectrum = reader.getRoot<Spectrum>();
//
// Trust    Cap'n Proto checks what it reads, but not against a peer that changes it meanwhile: read a duplicate() of such a peer's message.
#pragma once

#include <capnp/message.h>
#include <capnp/serialize.h>

#include <mpf/schema/message.h>

namespace mpf {

// Builds in place, in one segment. More than the message has room for: kj::Exception from the setter that needed it.
class UserBuilder {
 public:
  // Zeroes the whole room, as Cap'n Proto needs it.
  explicit UserBuilder(UserMessage message);

  template <class Root>
  typename Root::Builder initRoot() {
    return builder_.initRoot<Root>();
  }
  // The message, its size what was built. The builders of its structs are dead afterwards.
  [[nodiscard]] UserMessage finish() &&;

 private:
  UserMessage message_;
  capnp::FlatMessageBuilder builder_;
};

// Copies any Cap'n Proto message into a UserMessage on the heap.
[[nodiscard]] UserMessage toUserMessage(capnp::MessageBuilder& builder);

// Reads in place; throws kj::Exception when the bytes are no Cap'n Proto message. The UserMessage must outlive it.
class UserReader : public capnp::FlatArrayMessageReader {
 public:
  explicit UserReader(const UserMessage& message, capnp::ReaderOptions limits = {});
};

}  // namespace mpf
