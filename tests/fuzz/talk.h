// SPDX-License-Identifier: MIT
// Talk: uses one end of a link as a valid program does, whatever the other end writes.
#pragma once

#include <cstdint>
#include <memory>

#include "shm/messages/message_link.h"

namespace mpf::test {

// Sends an array; a long one is built in the pool of the link.
LinkSend sendArray(MessageLink& link, std::uint32_t requestId, std::size_t bytes);
// Reads all of a message: converts it to text, to JSON and to the wire format.
void lookAt(const Message& message);

class Talk {
 public:
  //   fanOut  of a server that publishes; null for a client
  explicit Talk(std::unique_ptr<Link> link, FanOutPool* fanOut = nullptr);
  ~Talk();
  Talk(const Talk&) = delete;
  Talk& operator=(const Talk&) = delete;

  // Receives some messages, returns some as replies, and sends a message. `value` chooses the
  // details.
  void turn(std::uint64_t value);

 private:
  bool tryTakeOne(std::uint64_t choice);
  bool tryFinish(const Envelope& envelope, Message& message);
  void sendBack(Envelope envelope, Message& message);
  void publish(std::uint64_t value);

  std::shared_ptr<MessageLink> channel_;
  FanOutPool* fanOut_;
  Message kept_;  // its body is released late
  bool isOver_ = false;
};

}  // namespace mpf::test
