// SPDX-License-Identifier: MIT
// FirstByte: examines the first byte of a stream, and returns it to the next reader.
#include "router/transport/first_byte.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <string>

#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class FirstByteTest : public testing::Test {
 public:
  ~FirstByteTest() noexcept override = default;

 protected:
  void send(const std::string& bytes) {
    pipe_.ends[1]->write(bytes.data(), bytes.size()).wait(io_.waitScope);
  }
  FirstByte first() { return readFirstByte(kj::mv(pipe_.ends[0])).wait(io_.waitScope); }
  // Reads at least `least` bytes, at most 16.
  std::string read(kj::AsyncIoStream& stream, std::size_t least) {
    std::string bytes(16, '.');
    bytes.resize(stream.tryRead(bytes.data(), least, bytes.size()).wait(io_.waitScope));
    return bytes;
  }

  const mpf::test::Watchdog watchdog_{"first byte"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  kj::TwoWayPipe pipe_ = io_.provider->newTwoWayPipe();  // of the kernel, which has a buffer
};

TEST_F(FirstByteTest, IsReadAgainFromTheStream) {
  send("abc");

  auto result = first();

  KJ_IF_MAYBE (byte, result.value) EXPECT_EQ(*byte, 'a');
  else ADD_FAILURE() << "no byte";
  EXPECT_EQ(read(*result.stream, 3), "abc");
  send("def");
  EXPECT_EQ(read(*result.stream, 3), "def") << "only the first read returns the byte again";
}

TEST_F(FirstByteTest, AReadOfOneByteDoesNotWaitForTheNext) {
  send("a");

  auto result = first();

  EXPECT_EQ(read(*result.stream, 1), "a");
}

TEST_F(FirstByteTest, IsAbsentWhenThePeerCloses) {
  pipe_.ends[1]->shutdownWrite();

  auto result = first();

  EXPECT_TRUE(result.value == nullptr);
}

}  // namespace
}  // namespace mpf::router::test
