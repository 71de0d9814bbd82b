// SPDX-License-Identifier: MIT
// Writes rows of a router's segment as a router does.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "router/statistics.h"

namespace mpf::test {

using Row = std::shared_ptr<router::PeerRecord>;

template <class Word>
void set(Word& word, std::uint64_t value) {
  word.store(static_cast<typename Word::value_type>(value), std::memory_order_relaxed);
}

// A remote "ioc1" that is connected, with these locations.
inline Row connectedRemote(router::Statistics& statistics,
                           const std::vector<std::int32_t>& locations) {
  auto row = statistics.add(layout::RouterRole::client);
  row->setAddress("10.0.0.7:9900");
  row->setPeer("ioc1", "mpf-router 0.1.0");
  row->setLocations(locations);
  row->setState(layout::RouterLineState::connected);
  set((*row)->connects, 3);
  set((*row)->queueSize, 100);
  set((*row)->inQueue, 7);
  set((*row)->queueFull, 2);
  set((*row)->clients, 4);
  set((*row)->bindings, 1);
  set((*row)->roundTripNs, 81'200);
  return row;
}

// A remote that refuses the connection.
inline Row lostRemote(router::Statistics& statistics,
                      const std::string& problem = "connect(): Connection refused") {
  auto row = statistics.add(layout::RouterRole::client);
  row->setAddress("10.0.0.8:9900");
  row->setLocations({8});
  row->setProblem(problem);
  row->setState(layout::RouterLineState::waiting);
  return row;
}

// A caller "ioc2", over TLS.
inline Row connectedCaller(router::Statistics& statistics) {
  auto row = statistics.add(layout::RouterRole::server);
  row->setAddress("10.0.0.9:51234");
  row->setPeer("ioc2", "mpf-router 0.2.0");
  row->setState(layout::RouterLineState::connected);
  set((*row)->isTls, 1);
  set((*row)->connects, 1);
  set((*row)->queueSize, 100);
  set((*row)->clients, 2);
  set((*row)->bindings, 1);
  return row;
}

}  // namespace mpf::test
