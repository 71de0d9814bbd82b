// SPDX-License-Identifier: MIT
#include "tests/fuzz/scene.h"

#include "shm/segment_name.h"
#include "tests/fuzz/hostile_files.h"
#include "tests/fuzz/talk.h"

namespace mpf::test {
namespace {

constexpr std::uint32_t kQueueSize = 4;
constexpr std::uint64_t kPoolBytes = 3 * layout::kPageBytes;
constexpr const char* kServer = "server";

void describeServer(layout::SegmentHeader& header) {
  std::string_view(kServer).copy(header.name.data(), header.name.size() - 1);
  header.maxMessageBytes = layout::kPageBytes;
  header.maxPoolBytes = kPoolBytes;
}

std::shared_ptr<MessageLink> channel(std::unique_ptr<Link> link) {
  return MessageLink::make(std::move(link), std::make_shared<BiasedLock>());
}

}  // namespace

Scene::Scene()
    : backplane(fuzzBackplane()),
      server(backplaneName(), layout::SegmentKind::serverWindow, serverName(), Rights{},
             describeServer),
      client(backplaneName(), layout::SegmentKind::clientWindow, "", Rights{},
             [](layout::SegmentHeader&) {}) {
  server.control().queueSize.store(kQueueSize, std::memory_order_relaxed);
  auto peer = PeerWindow::tryOpen(serverName(), layout::SegmentKind::serverWindow);
  auto link = Link::create(backplaneName(), client, 0, peer);
  auto other = Link::tryOpen(backplaneName(), link->name(), server);
  other->attachPeer(PeerWindow::tryOpen(clientName(), layout::SegmentKind::clientWindow), 0);
  other->setState(layout::LinkState::open);
  clientLink = channel(std::move(link));
  serverLink = channel(std::move(other));
  for (const std::uint32_t bytes : {8u, 120u, 600u}) sendArray(*clientLink, bytes, bytes);
  for (const std::uint32_t bytes : {8u, 600u}) sendArray(*serverLink, bytes, bytes);
}

std::string Scene::serverName() const {
  return SegmentName::serverWindow(backplaneName(), 0, kServer);
}

std::string Scene::clientName() const {
  return SegmentName::keyed(backplaneName(), NameKind::clientWindow, client.header().incarnation);
}

std::string Scene::hintsOf(const OwnWindow& window) const {
  return SegmentName::keyed(backplaneName(), NameKind::hints, window.header().incarnation);
}

std::string Scene::bulkName(LinkSide side) const {
  return SegmentName::bulk(backplaneName(), clientLink->link().header().incarnation,
                           static_cast<std::uint32_t>(side), 0);
}

}  // namespace mpf::test
