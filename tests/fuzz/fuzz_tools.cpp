// SPDX-License-Identifier: MIT
// The tools mpf inspect, ls, top and tap read the invalid files of a server and a client.
//   files: 0 link, 1 server window, 2 client window, 3 and 4 their hints, 5 and 6 the client's and
//   the server's pool
#include <memory>
#include <vector>

#include "shm/segment.h"
#include "tests/fuzz/fuzzers.h"
#include "tests/fuzz/hostile_files.h"
#include "tests/fuzz/scene.h"
#include "tests/fuzz/talk.h"
#include "tools/inspect/outline.h"
#include "tools/report/snapshot.h"
#include "tools/tap/link_follower.h"

namespace mpf::test {
namespace {

class Reader {
 public:
  Reader(const Scene& scene, const HostileFiles& files) : scene_(scene), files_(files) {}

  void turn(std::uint64_t value) {
    const auto what = value % 16;
    if (what == 15) static_cast<void>(tools::Snapshot::take(scene_.backplaneName()));
    else if (what >= 8) dissect(what - 8, value);
    else follow(value);
  }

 private:
  void dissect(std::size_t file, std::uint64_t value) try {
    const auto tree = tools::tryDissect(segments::path(files_.name(file)),
                                        {.last = value / 16 % 16, .raw = value / 256 % 8 == 7});
    if (tree) static_cast<void>(tools::outline(*tree));
    // NOLINTNEXTLINE(bugprone-empty-catch): the tool reports it and continues
  } catch (const SegmentError&) {
  }

  void follow(std::uint64_t value) try {
    const auto from = value % 2 == 0 ? tools::FollowFrom::first : tools::FollowFrom::newest;
    if (!follower_)
      follower_ = tools::LinkFollower::tryOpen(scene_.backplaneName(), files_.name(0), from);
    if (!follower_) return;
    std::vector<tools::TappedMessage> messages;
    follower_->take(messages);
    for (const auto& tapped : messages) {
      if (tapped.message) lookAt(tapped.message);
    }
    static_cast<void>(follower_->missed());
    static_cast<void>(follower_->isOver());
    // NOLINTNEXTLINE(bugprone-empty-catch): the tool reports it and continues
  } catch (const SegmentError&) {
  }
  const Scene& scene_;
  const HostileFiles& files_;
  std::unique_ptr<tools::LinkFollower> follower_;
};

}  // namespace

void playTools(std::span<const std::uint8_t> input) {
  static Scene scene;
  static HostileFiles files(
      scene.backplane, {scene.clientLink->link().name(), scene.serverName(), scene.clientName(),
                        scene.hintsOf(scene.server), scene.hintsOf(scene.client),
                        scene.bulkName(LinkSide::client), scene.bulkName(LinkSide::server)});
  files.play(input, [] { return Reader(scene, files); });
}

}  // namespace mpf::test
