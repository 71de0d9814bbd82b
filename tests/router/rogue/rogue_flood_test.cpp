// SPDX-License-Identifier: MIT
// A rogue floods a server router and does not read the answers. The router's memory does not grow,
// and honest clients are served.
#include <chrono>
#include <thread>

#include "tests/router/rogue/rogue_client.h"

namespace mpf::test {
namespace {

// Sends the same bytes again and again, as fast as the router reads them, until the router closes
// the connection or the Flood is destroyed.
class Flood {
 public:
  Flood(RoguePeer& peer, const Bytes& bytes)
      : peer_(peer), thread_([&peer, &bytes] {
          while (peer.send(bytes)) {
          }
        }) {}
  ~Flood() {
    peer_.hangUp();
    thread_.join();
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;

 private:
  RoguePeer& peer_;
  std::thread thread_;
};

class RogueFloodTest : public RogueClientTest {
 protected:
  void flood(const Bytes& bytes, const std::vector<Fill>& before = {}) {
    constexpr int kRounds = 20;
    constexpr std::size_t kFloodKb = kIsSanitized ? 2 << 20 : 32 << 10;
    auto peer = rogue();
    peer.sendItems(before);
    const auto quiet = usage();
    const Flood flooding(peer, bytes);
    for (int round = 0; round < kRounds; ++round) {
      expectHonestWork();
      EXPECT_LE(usage().residentKb, quiet.residentKb + kFloodKb) << "during the flood";
    }
  }
};

TEST_F(RogueFloodTest, OfEmptyFrames) {
  Bytes frames;
  for (const auto frame = frameOf({}); frames.size() < 10'000 * frame.size();)
    frames.insert(frames.end(), frame.begin(), frame.end());
  flood(frames);
}

TEST_F(RogueFloodTest, OfRequestsThatAreRefused) {
  std::vector<Fill> requests;
  for (int i = 0; i < 10'000; ++i) requests.push_back(request(1, 1));
  flood(frameOf(requests));
}

TEST_F(RogueFloodTest, OfRequestsThatAreAnswered) {
  std::vector<Fill> requests;
  for (std::uint32_t id = 1; id < 200; ++id) requests.push_back(request(1, id));
  flood(frameOf(requests));
}

TEST_F(RogueFloodTest, OfRequestsOfAClientWithoutAServer) {
  std::vector<Fill> requests;
  for (std::uint32_t id = 1; id < 10'000; ++id) requests.push_back(request(2, id));
  flood(frameOf(requests), {open(2, 77, 0)});
}

TEST_F(RogueFloodTest, OfRefusedBindings) {
  std::vector<Fill> binds;
  for (int i = 0; i < 10'000; ++i) binds.push_back(bind(2, "echo", 99));
  flood(frameOf(binds));
}

TEST_F(RogueFloodTest, OfClientsThatOpenAndClose) {
  auto peer = rogue();
  for (std::uint32_t client = 2; client < 2000; client += 10) {
    std::vector<Fill> items;
    for (std::uint32_t i = client; i < client + 10; ++i) {
      items.insert(items.end(), {open(i, 1, incarnation_), request(i, 1), request(i, 2), close(i)});
    }
    ASSERT_TRUE(peer.sendItems(items));
  }
  expectHonestWork();
  peer.sendItems({open(5000, 1, incarnation_)});
  expectAnswer(peer, 5000, 3, 9);
}

// The number of lines in `said` that contain `text`.
std::int64_t linesWith(const std::string& text, const std::string& said) {
  std::int64_t lines = 0;
  for (auto at = said.find(text); at != std::string::npos; at = said.find(text, at + 1)) ++lines;
  return lines;
}

// The log has some lines at once, and then one per second for all connections together.
TEST_F(RogueFloodTest, OfConnectionsKeepsTheLogShort) {
  constexpr int kAtOnce = 32;
  const auto begun = std::chrono::steady_clock::now();

  for (int caller = 0; caller < 200; ++caller) {
    auto peer = stranger();
    peer.sendItems({greeting()});
    peer.sendItems({bind(1, "echo", 99)});
    peer.next(wire::Item::SERVER);
    peer.sendNoMore();
    peer.farewell();
  }
  expectHonestWork();

  const auto said = routers_.farRouter().said();
  const auto seconds =
      std::chrono::ceil<std::chrono::seconds>(std::chrono::steady_clock::now() - begun).count();
  EXPECT_LE(linesWith(" is connected (", said), kAtOnce + 1 + seconds);
  EXPECT_LE(linesWith(" disconnected: ", said), kAtOnce + 1 + seconds);
  EXPECT_LE(linesWith(" is not allowed for this peer", said), kAtOnce + seconds);
}

}  // namespace
}  // namespace mpf::test
