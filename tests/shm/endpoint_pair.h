// SPDX-License-Identifier: MIT
// End: an endpoint with its links. connect() creates a link from a client's End to a server's End,
// both sides at once.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "shm/endpoint.h"
#include "shm/segment_name.h"

namespace mpf::test {

struct Offer {
  std::uint32_t queueSize = 64;
  std::uint64_t maxMessageBytes = 1 << 20;
  std::uint64_t maxPoolBytes = 16 << 20;
};

struct End final : LinkUser {
  // If `server` is empty, this is a client.
  End(const Backplane& backplane, const std::string& server, WaitMode mode = WaitMode::adaptive,
      Offer offer = {})
      : endpoint(
            backplane,
            server.empty() ? layout::SegmentKind::clientWindow : layout::SegmentKind::serverWindow,
            server.empty() ? "" : SegmentName::serverWindow(backplane.name(), 0, server), Rights{},
            mode, [&](layout::SegmentHeader& header) {
              server.copy(header.name.data(), header.name.size() - 1);
              header.maxMessageBytes = offer.maxMessageBytes;
              header.maxPoolBytes = offer.maxPoolBytes;
              header.linkMode = 0600;
              header.linkGroup = ~0u;
            }) {
    endpoint.control().queueSize.store(offer.queueSize, std::memory_order_relaxed);
  }
  ~End() {
    for (std::uint32_t index = 0; index < links.size(); ++index) drop(index);
  }
  End(const End&) = delete;
  End& operator=(const End&) = delete;

  void drop(std::uint32_t index) {
    if (!links[index]) return;
    endpoint.detach(index);
    links[index].reset();
  }
  Link& keep(std::uint32_t index, std::unique_ptr<Link> link) {
    if (links.size() <= index) links.resize(index + 1);
    links[index] = std::move(link);
    endpoint.attach(index, *links[index], *this);
    return *links[index];
  }
  // A value for Envelope, for tests that check only one word.
  static std::optional<std::uint32_t> tryTake(Link& link) {
    if (!link.incoming().hasMessage()) return std::nullopt;
    const auto id = link.incoming().begin().requestId;
    link.incoming().end();
    return id;
  }

  // By their bits. Declared before the endpoint, whose destructor uses them.
  std::vector<std::unique_ptr<Link>> links;
  Endpoint endpoint;
};

struct Connected {
  Link& client;
  Link& server;
  std::uint32_t clientIndex;
  std::uint32_t serverIndex;
};

inline Connected connect(End& client, End& server) {
  const auto& backplane = client.endpoint.backplane().name();
  const auto clientIndex = client.endpoint.tryReserve().value();
  const auto serverIndex = server.endpoint.tryReserve().value();
  const std::string_view serverName(server.endpoint.window().header().name.data());
  auto peer = client.endpoint.peers().tryOpen(SegmentName::serverWindow(backplane, 0, serverName),
                                              layout::SegmentKind::serverWindow);
  auto& ours = client.keep(
      clientIndex, Link::create(backplane, client.endpoint.window(), clientIndex, std::move(peer)));
  auto link = Link::tryOpen(backplane, ours.name(), server.endpoint.window());
  const auto clientName =
      SegmentName::keyed(backplane, NameKind::clientWindow, link->header().clientWindow);
  link->attachPeer(server.endpoint.peers().tryOpen(clientName, layout::SegmentKind::clientWindow),
                   link->header().clientIndex);
  auto& theirs = server.keep(serverIndex, std::move(link));
  ours.setPeerIndex(serverIndex);
  return {ours, theirs, clientIndex, serverIndex};
}

// Sends `id` with a body of `bytes`.
inline LinkSend send(Link& link, std::uint32_t id, std::size_t bytes = 8) {
  Envelope envelope{.requestId = id};
  return link.trySend(envelope, std::vector<std::byte>(bytes), {});
}

}  // namespace mpf::test
