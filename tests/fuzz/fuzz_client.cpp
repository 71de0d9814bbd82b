// SPDX-License-Identifier: MIT
// A client connects to a server whose window, hints and half of the link have invalid contents.
//   files: 0 server window, 1 its hints, 2 the link, once it exists
#include <optional>

#include "shm/segment_name.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/hostile_files.h"
#include "tests/fuzz/scene.h"
#include "tests/fuzz/talk.h"

namespace mpf::test {
namespace {

class Client {
 public:
  Client(Scene& scene, HostileFiles& files) : scene_(scene), files_(files) {}

  void turn(std::uint64_t value) try {
    if (!talk_) attach(value);
    else talk_->turn(value);
  } catch (const std::exception&) {  // as a client's dispatcher does: it gives up this server
    talk_.reset();
  }

 private:
  void attach(std::uint64_t value) {
    const auto peer = PeerWindow::tryOpen(scene_.serverName(), layout::SegmentKind::serverWindow);
    if (!peer || peer->isClosed() || !peer->hasOwner()) return;
    static_cast<void>(peer->user());
    auto link = Link::create(scene_.backplaneName(), scene_.client,
                             static_cast<std::uint32_t>(value), peer);
    files_.add(link->name());
    peer->knock(link->header().incarnation);
    talk_.emplace(std::move(link));
  }
  Scene& scene_;
  HostileFiles& files_;
  std::optional<Talk> talk_;
};

}  // namespace

void playClient(std::span<const std::uint8_t> input) {
  static Scene scene;
  static HostileFiles files(scene.backplane, {scene.serverName(), scene.hintsOf(scene.server)});
  files.play(input, [] { return Client(scene, files); });
}

}  // namespace mpf::test
