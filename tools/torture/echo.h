// SPDX-License-Identifier: MIT
// Echo: the servers of a torture. It checks each request to the last byte, and answers in place,
// with a new message, or late.
//
// Threads  one.
#pragma once

#include <string>

#include <mpf/message_server.h>

#include "tools/torture/world.h"

namespace mpf::torture {

class Echo {
 public:
  Echo(const Backplane& backplane, const std::string& name, World& world, WaitMode waitMode);

  // Until the board says to leave.
  void run(const Board& board, bool byDescriptor);
  // What has come until now.
  void handleAll();

 private:
  void handle(Message&& request);
  void answer(Int32Message&& request);
  void answer(Float64ArrayMessage&& request);
  void send(Message&& reply);
  bool note(std::int32_t value, bool isSound);

  World& world_;
  MessageServer server_;
  Message kept_;
  std::uint32_t arrays_ = 0;
};

}  // namespace mpf::torture
