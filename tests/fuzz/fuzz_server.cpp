// SPDX-License-Identifier: MIT
// A server accepts a client whose link, window, hints and pool have invalid contents.
//   files: 0 link, 1 client window, 2 its hints, 3 the client's pool, 4 the server's hints
#include <optional>

#include "shm/segment_name.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/hostile_files.h"
#include "tests/fuzz/scene.h"
#include "tests/fuzz/talk.h"

namespace mpf::test {
namespace {

class Server {
 public:
  explicit Server(Scene& scene) : scene_(scene) {}

  void turn(std::uint64_t value) try {
    if (!talk_) attach();
    if (talk_) talk_->turn(value);
  } catch (const std::exception&) {  // as Acceptor does: it gives up this link
    talk_.reset();
  }

 private:
  void attach() {
    auto link =
        Link::tryOpen(scene_.backplaneName(), scene_.clientLink->link().name(), scene_.server);
    if (!link) return;
    const auto window = SegmentName::keyed(scene_.backplaneName(), NameKind::clientWindow,
                                           link->header().clientWindow);
    auto client = PeerWindow::tryOpen(window, layout::SegmentKind::clientWindow);
    if (!client || client->isClosed() || !client->hasOwner()) return;
    link->attachPeer(std::move(client), link->header().clientIndex);
    link->setState(layout::LinkState::open);
    link->notifyPeer();
    talk_.emplace(std::move(link), &fanOut_);
  }
  Scene& scene_;
  FanOutPool fanOut_{scene_.backplaneName(), scene_.server.header().incarnation, Rights{},
                     16 * layout::kPageBytes};
  std::optional<Talk> talk_;
};

}  // namespace

void playServer(std::span<const std::uint8_t> input) {
  static Scene scene;
  static HostileFiles files = [] {
    scene.serverLink.reset();  // Server::attach() replaces it
    return HostileFiles(
        scene.backplane,
        {scene.clientLink->link().name(), scene.clientName(), scene.hintsOf(scene.client),
         scene.bulkName(LinkSide::client), scene.hintsOf(scene.server)});
  }();
  files.play(input, [] { return Server(scene); });
}

}  // namespace mpf::test
