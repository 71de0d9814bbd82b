// SPDX-License-Identifier: MIT
// Hand-made snapshots: a server and a client, and links between them.
#pragma once

#include <utility>
#include <vector>

#include "tools/report/snapshot_delta.h"

namespace mpf::test {

// Incarnations of the windows.
inline constexpr std::uint64_t kServer = 1;
inline constexpr std::uint64_t kClient = 2;

inline constexpr std::int64_t kHalfASecond = 500'000'000;

inline tools::LinkView linkView(std::uint64_t incarnation, tools::Traffic requests,
                                tools::Traffic replies = {}) {
  tools::LinkView view;
  view.incarnation = incarnation;
  view.serverWindow = kServer;
  view.clientWindow = kClient;
  view.requests = requests;
  view.replies = replies;
  return view;
}

inline tools::WindowView serverView(std::uint64_t received, std::uint64_t sent,
                                    std::vector<tools::LinkView> links = {}) {
  tools::WindowView view;
  view.isServer = true;
  view.incarnation = kServer;
  view.received = received;
  view.sent = sent;
  view.processState = 'S';
  view.links = std::move(links);
  return view;
}

inline tools::WindowView clientView(std::uint64_t received,
                                    std::vector<tools::LinkView> links = {}) {
  auto view = serverView(received, 0, std::move(links));
  view.isServer = false;
  view.incarnation = kClient;
  return view;
}

inline tools::Snapshot snapshotOf(std::int64_t atNs, std::vector<tools::WindowView> servers,
                                  std::vector<tools::WindowView> clients = {}) {
  tools::Snapshot made;
  made.atNs = atNs;
  made.servers = std::move(servers);
  made.clients = std::move(clients);
  return made;
}

}  // namespace mpf::test
