// SPDX-License-Identifier: MIT
// A peer that is valid at first: mpf_test_hostile client|server BACKPLANE KIND. Prints "hostile"
// after many attacks, and then continues until it is killed; sometimes it creates a new window and
// link. Kinds in addition to those of Attacker: flood (sends as fast as possible, takes nothing),
// slow (takes one message at a time and frees none).
#include <sys/prctl.h>

#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <mpf/message.h>

#include "shm/segment_name.h"
#include "tests/hostile/attacker.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

constexpr int kStepsOfALink = 500;
constexpr int kLinks = 12;
constexpr const char* kServer = "echo";

class Peer final : LinkUser {
 public:
  Peer(const Backplane& backplane, LinkSide side, std::string kind, Random& random)
      : side_(side),
        endpoint_(backplane,
                  side == LinkSide::client ? layout::SegmentKind::clientWindow
                                           : layout::SegmentKind::serverWindow,
                  side == LinkSide::client
                      ? ""
                      : SegmentName::serverWindow(backplane.name(), 0, "hostile"),
                  Rights{0666, ~0u}, WaitMode::block,
                  [](layout::SegmentHeader& header) {
                    header.queueSize = 32;
                    header.maxMessageBytes = 1 << 20;
                    header.maxPoolBytes = 4 << 20;
                  }),
        kind_(std::move(kind)),
        attacker_(kind_, endpoint_.window(), random) {
    endpoint_.control().queueSize.store(32, std::memory_order_relaxed);
  }

  void run() {
    const auto index = endpoint_.tryReserve().value();
    link_ = side_ == LinkSide::client ? connect(index) : accept(index);
    beLegal();
    attacker_.reach(*link_);
    for (int step = 0; step < kStepsOfALink; ++step) act(step);
    endpoint_.detach(index);
    link_->setState(layout::LinkState::closed);
    link_->notifyPeer();
  }

 private:
  std::unique_ptr<Link> connect(std::uint32_t index) {
    std::shared_ptr<PeerWindow> server;
    while (!server)
      server = endpoint_.peers().tryOpen(SegmentName::serverWindow(backplane(), 0, kServer),
                                         layout::SegmentKind::serverWindow);
    auto link = Link::create(backplane(), endpoint_.window(), index, server);
    endpoint_.attach(index, *link, *this);
    // The server may still be busy with earlier attacks.
    while (link->peerState() != layout::LinkState::open) {
      server->knock(link->header().incarnation);
      endpoint_.wait(Deadline::after(5ms));
      static_cast<void>(endpoint_.next());
    }
    link->usePeerIndexOfServer();
    return link;
  }
  std::unique_ptr<Link> accept(std::uint32_t index) {
    for (;;) {
      endpoint_.wait(Deadline::after(5ms));
      static_cast<void>(endpoint_.next());
      for (const auto& name : segments::list(
               SegmentName::linkPrefix(backplane(), endpoint_.window().header().incarnation))) {
        if (auto link = tryAccept(name, index)) return link;
      }
    }
  }
  std::unique_ptr<Link> tryAccept(const std::string& name, std::uint32_t index) try {
    auto link = Link::tryOpen(backplane(), name, endpoint_.window());
    if (!link ||
        link->control().serverState.load(std::memory_order_relaxed) != layout::LinkState::none)
      return nullptr;
    auto client = endpoint_.peers().tryOpen(
        SegmentName::keyed(backplane(), NameKind::clientWindow, link->header().clientWindow),
        layout::SegmentKind::clientWindow);
    if (!client) return nullptr;
    link->attachPeer(std::move(client), link->header().clientIndex);
    endpoint_.attach(index, *link, *this);
    link->control().serverIndex.store(index, std::memory_order_relaxed);
    link->setState(layout::LinkState::open);
    link->notifyPeer();
    return link;
  } catch (const std::exception&) {
    return nullptr;  // the file is truncated
  }
  // First some valid messages, so that pools exist.
  void beLegal() {
    for (std::uint32_t id = 1; id < 5; ++id) send(id, id % 2 == 0 ? 3000 : sizeof(Int32));
    for (int turn = 0; turn < 4; ++turn) takeOne(true);
  }
  void send(std::uint32_t id, std::size_t bytes) {
    const auto type = bytes == sizeof(Int32) ? MessageType::int32 : MessageType::float64Array;
    Envelope envelope{.type = static_cast<std::uint16_t>(type), .requestId = id};
    if (side_ == LinkSide::server)
      envelope.flags = id % 2 == 0 ? layout::kSlotFirstReply : std::uint8_t{0};
    static_cast<void>(link_->trySend(envelope, std::vector<std::byte>(bytes), {}));
  }
  void takeOne(bool frees) {
    if (!link_->incoming().hasMessage()) return;
    const auto envelope = link_->incoming().begin();
    if (!frees) return;
    if ((envelope.flags & layout::kSlotChunk) != 0) {
      try {
        if (const auto chunk = link_->tryChunk(envelope.bodyBytes)) link_->release(chunk->data);
      } catch (const ChunkUnavailable&) {  // NOLINT(bugprone-empty-catch): its server has ended
      }
    }
    link_->incoming().end();
  }
  void act(int step) {
    if (kind_ == "flood")
      return send(static_cast<std::uint32_t>(step + 5), step % 8 == 0 ? 3000 : sizeof(Int32));
    if (kind_ == "slow") {
      if (step % 100 == 0) send(static_cast<std::uint32_t>(step + 5), sizeof(Int32));
      return takeOne(false);
    }
    attacker_.act(*link_);
    if (step % 16 == 0) link_->notifyPeer();
  }
  [[nodiscard]] const std::string& backplane() const { return endpoint_.backplane().name(); }

  LinkSide side_;
  std::unique_ptr<Link> link_;
  Endpoint endpoint_;
  std::string kind_;
  Attacker attacker_;
};

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) try {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::vector<std::string> arguments(argv, argv + argc);
  const auto side = arguments.at(1) == "client" ? mpf::LinkSide::client : mpf::LinkSide::server;
  const auto backplane = mpf::Backplane::attach(arguments.at(2));
  mpf::test::Random random;
  for (int links = 0;; ++links) {
    if (links == mpf::test::kLinks) std::puts("hostile");
    std::fflush(stdout);
    mpf::test::Peer(backplane, side, arguments.at(3), random).run();
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "hostile: %s\n", error.what());
  return 1;
}
