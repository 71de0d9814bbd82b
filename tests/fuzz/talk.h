// SPDX-License-Identifier: MIT
// Talk: what an honest program does with its end of a link, whatever the other end writes.
#pragma once

#include <cstdint>
#include <memory>

#include "shm/messages/message_link.h"

namespace mpf::test {

// Sends an array, built in the link's pool when it is long.
LinkSend sendArray(MessageLink& link, std::uint32_t requestId, std::size_t bytes);
// Looks at all of a message that a program might: as text, as JSON, on the wire.
void lookAt(const Message& message);

class Talk {
 public:
  explicit Talk(std::unique_ptr<Link> link);
  ~Talk();
  Talk(const Talk&) = delete;
  Talk& operator=(const Talk&) = delete;

  // Takes some messages, sends some back, sends one of its own. `value` chooses how.
  void turn(std::uint64_t value);

 private:
  bool tryTakeOne(std::uint64_t choice);
  void sendBack(Envelope envelope, Message& message);

  std::shared_ptr<MessageLink> channel_;
  Message kept_;  // a body that is given back late
  bool isOver_ = false;
};

}  // namespace mpf::test
