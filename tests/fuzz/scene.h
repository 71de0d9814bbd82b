// SPDX-License-Identifier: MIT
// Scene: a valid server and client with a link, and with pending requests and replies of every
// form.
//
//   request ring: in one slot, in three slots, in a chunk     reply ring: in one slot, in a chunk
//
// The files are small, so that a fuzzer restores them in microseconds.
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
  // Names of segments.
  [[nodiscard]] std::string serverName() const;
  [[nodiscard]] std::string clientName() const;
  [[nodiscard]] std::string hintsOf(const OwnWindow& window) const;
  // The first segment of a side's pool.
  [[nodiscard]] std::string bulkName(LinkSide side) const;

  Backplane backplane;
  OwnWindow server;
  OwnWindow client;
  std::shared_ptr<MessageLink> clientLink;
  std::shared_ptr<MessageLink> serverLink;
};

}  // namespace mpf::test
