// SPDX-License-Identifier: MIT
// Echo: the servers of `mpf torture`. It checks the contents of each request. It replies in place,
// to several requests together, with a new or a published message, with many values, or late.
//
// Threads  one.
#pragma once

#include <span>
#include <string>

#include <mpf/message_server.h>

#include "tools/torture/world.h"

namespace mpf::torture {

class Echo {
 public:
  Echo(const Backplane& backplane, const std::string& name, World& world, WaitMode waitMode);

  // Runs until the board says to leave.
  void run(const Board& board, bool byDescriptor);
  // Handles the requests that have arrived.
  void handleAll();

 private:
  void answer(std::span<OutOfBand> requests);
  void answer(Int32Message&& request);
  void answerMany(const Int32Message& answer);
  void answer(Float64ArrayMessage&& request);
  void send(Message&& reply);
  void check(ReplyResult result);
  bool note(std::int32_t value, bool isSound);

  World& world_;
  MessageServer server_;
  Message kept_;
  std::uint32_t arrays_ = 0;
};

}  // namespace mpf::torture
