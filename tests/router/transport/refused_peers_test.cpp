// SPDX-License-Identifier: MIT
// RefusedPeers: each rejected peer gets a farewell, and its connection is closed.
#include "router/transport/refused_peers.h"

#include <capnp/serialize-async.h>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <vector>

#include "router/transport/kj_text.h"
#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class RefusedPeersTest : public testing::Test {
 public:
  ~RefusedPeersTest() noexcept override = default;

 protected:
  // Rejects a new connection. Returns the peer's end of it.
  kj::Own<kj::AsyncIoStream> reject() {
    auto pipe = io_.provider->newTwoWayPipe();  // of the kernel, which has a buffer
    refused_.add(kj::mv(pipe.ends[0]), FarewellCode::LIMIT, "too many");
    return kj::mv(pipe.ends[1]);
  }
  // Returns the number of bytes that are read until the router closes the connection.
  std::size_t readToEnd(kj::AsyncIoStream& peer) {
    return peer.readAllBytes().wait(io_.waitScope).size();
  }

  const mpf::test::Watchdog watchdog_{"refused peers"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  RefusedPeers refused_{io_.provider->getTimer()};
};

TEST_F(RefusedPeersTest, GetTheReason) {
  auto peer = reject();

  auto frame = capnp::readMessage(*peer).wait(io_.waitScope);

  const auto items = frame->getRoot<wire::Frame>().getItems();
  ASSERT_EQ(items.size(), 1u);
  EXPECT_EQ(items[0].getFarewell().getCode(), FarewellCode::LIMIT);
  EXPECT_EQ(toStd(items[0].getFarewell().getReason()), "too many");
  EXPECT_EQ(readToEnd(*peer), 0u);
}

// Beyond a fixed number, connections are closed at once: no peer can make the router keep them.
TEST_F(RefusedPeersTest, AreClosedWithoutAFarewellWhenThereAreTooMany) {
  std::vector<kj::Own<kj::AsyncIoStream>> peers;
  for (int i = 0; i < 64; ++i) peers.push_back(reject());

  EXPECT_EQ(readToEnd(*reject()), 0u);

  for (auto& peer : peers) {
    EXPECT_GT(readToEnd(*peer), 0u);
    peer = nullptr;
  }
  while (readToEnd(*reject()) == 0)  // there is room again once the router has seen their end
    io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
}

}  // namespace
}  // namespace mpf::router::test
