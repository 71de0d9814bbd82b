// SPDX-License-Identifier: MIT
// Receiver: a server that does not poll, the client side of a link to it, and whether it was
// notified of a message.
#pragma once

#include <gtest/gtest.h>
#include <string>

#include "tests/shm/endpoint_pair.h"

namespace mpf::test {

struct Receiver {
  Receiver(const Backplane& backplane, const std::string& name, Offer offer = {})
      : server(backplane, name, WaitMode::block, offer),
        client(backplane, "", WaitMode::block),
        link(connect(client, server)) {
    static_cast<void>(wasNotified());
  }
  void sendOne() const { EXPECT_EQ(send(link.client, 1), LinkSend::sent); }
  // Whether a notice has arrived since the last call.
  [[nodiscard]] bool wasNotified() {
    auto& bits = server.endpoint.window().hints().readyBits[0];
    return bits.exchange(0, std::memory_order_relaxed) != 0;
  }

  End server;
  End client;
  Connected link;
};

}  // namespace mpf::test
