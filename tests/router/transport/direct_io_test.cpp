// SPDX-License-Identifier: MIT
// DirectIo: what the kernel has or takes at once, without waiting.
#include "router/transport/direct_io.h"

#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class DirectIoTest : public testing::Test {
 public:
  ~DirectIoTest() noexcept override = default;

 protected:
  using Piece = kj::ArrayPtr<const kj::byte>;

  std::size_t write(const std::vector<Piece>& pieces) {
    return direct_.tryWrite({pieces.data(), pieces.size()});
  }
  std::string readByPeer(std::size_t bytes) {
    std::string text(bytes, '?');
    peer_->read(text.data(), bytes).wait(io_.waitScope);
    return text;
  }

  const mpf::test::Watchdog watchdog_{"direct I/O"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  kj::TwoWayPipe pipe_ = io_.provider->newTwoWayPipe();
  kj::Own<kj::AsyncIoStream> stream_ = kj::mv(pipe_.ends[0]);
  kj::Own<kj::AsyncIoStream> peer_ = kj::mv(pipe_.ends[1]);
  DirectIo direct_{*stream_};
  std::vector<kj::byte> room_ = std::vector<kj::byte>(16);
  kj::ArrayPtr<kj::byte> roomPtr_{room_.data(), room_.size()};
};

TEST_F(DirectIoTest, ReadsWhatIsThere) {
  EXPECT_EQ(direct_.tryRead(roomPtr_), std::nullopt);
  peer_->write("abc", 3).wait(io_.waitScope);

  EXPECT_EQ(direct_.tryRead(roomPtr_), 3u);

  EXPECT_EQ(room_[2], 'c');
  EXPECT_EQ(direct_.tryRead(roomPtr_), std::nullopt);
  peer_ = nullptr;
  EXPECT_EQ(direct_.tryRead(roomPtr_), 0u);
}

TEST_F(DirectIoTest, WritesMorePiecesThanOneSystemCallTakes) {
  const std::string letters = "abcdefghij";
  std::vector<Piece> pieces;
  std::string expected;
  for (std::size_t i = 0; i < 200; ++i) {
    const auto* const letter = letters.data() + i % letters.size();
    pieces.emplace_back(reinterpret_cast<const kj::byte*>(letter), 1);
    expected += *letter;
  }

  EXPECT_EQ(write(pieces), pieces.size());

  EXPECT_EQ(readByPeer(pieces.size()), expected);
}

TEST_F(DirectIoTest, WritesOnlyWhatTheKernelTakes) {
  const std::vector<kj::byte> block(std::size_t{4} << 20);
  const Piece piece{block.data(), block.size()};

  const auto written = write({piece, piece});

  EXPECT_GT(written, 0u);
  EXPECT_LT(written, 2 * block.size());
  EXPECT_EQ(write({piece}), 0u);
}

TEST_F(DirectIoTest, ReportsABrokenConnectionAsTheStreamDoes) {
  const kj::byte byte{};
  peer_ = nullptr;

  try {
    write({{&byte, 1}});
    FAIL() << "no exception";
  } catch (const kj::Exception& error) {
    EXPECT_EQ(error.getType(), kj::Exception::Type::DISCONNECTED);
  }
}

TEST_F(DirectIoTest, HasNothingWithoutADescriptor) {
  auto inMemory = kj::newTwoWayPipe();
  const DirectIo none(*inMemory.ends[0]);
  const kj::byte byte{};
  const Piece piece{&byte, 1};

  EXPECT_FALSE(none);
  EXPECT_TRUE(direct_);
  EXPECT_EQ(none.tryRead(roomPtr_), std::nullopt);
  EXPECT_EQ(none.tryWrite({&piece, 1}), 0u);
}

}  // namespace
}  // namespace mpf::router::test
