// SPDX-License-Identifier: MIT
// Scene: a server and a client with a link, as the code makes them, and some requests and replies
// of every form under way.
//
//   requests ring: in one slot, in three, in a chunk        replies ring: in one slot, in a chunk
//
// Small, so that a fuzzer restores it in microseconds.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <mpf/backplane.h>

#include "shm/messages/message_link.h"

namespace mpf::test {

struct Scene {
  Scene();

  [[nodiscard]] const std::string& backplaneName() const noexcept { return backplane.name(); }
  // Names of a window's files.
  [[nodiscard]] std::string serverName() const;
  [[nodiscard]] std::string clientName() const;
  [[nodiscard]] std::string hintsOf(const OwnWindow& window) const;
  // The first segment of a pool.
  [[nodiscard]] std::string bulkName(LinkSide side) const;

  Backplane backplane;
  OwnWindow server;
  OwnWindow client;
  std::shared_ptr<MessageLink> clientLink;
  std::shared_ptr<MessageLink> serverLink;
};

}  // namespace mpf::test
