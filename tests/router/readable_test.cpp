// SPDX-License-Identifier: MIT
// Readable and Bell: call back on the event loop.
#include "router/readable.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <gtest/gtest.h>
#include <kj/async-io.h>
#include <thread>

#include "tests/support/watchdog.h"

namespace mpf::router::test {
namespace {

class ReadableTest : public testing::Test {
 public:
  ~ReadableTest() noexcept override = default;

 protected:
  void runUntilCalls(int calls) {
    while (calls_ < calls)
      io_.provider->getTimer().afterDelay(kj::MILLISECONDS).wait(io_.waitScope);
  }

  const mpf::test::Watchdog watchdog_{"readable"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  int calls_ = 0;
};

TEST_F(ReadableTest, CallsBackAtTheStartAndForEachArrivalOfData) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK), 0);
  const FileDescriptor in(ends[0]);
  const FileDescriptor out(ends[1]);
  std::size_t bytes = 0;
  const Readable readable(io_.unixEventPort, in.get(), [&] {
    ++calls_;
    char byte = 0;
    while (::read(in.get(), &byte, 1) == 1) ++bytes;
  });
  runUntilCalls(1);
  EXPECT_EQ(bytes, 0u);

  ASSERT_EQ(::write(out.get(), "ab", 2), 2);
  runUntilCalls(2);
  EXPECT_EQ(bytes, 2u);
  ASSERT_EQ(::write(out.get(), "c", 1), 1);
  runUntilCalls(3);
  EXPECT_EQ(bytes, 3u);
}

TEST_F(ReadableTest, ABellRingsFromAnotherThread) {
  const Bell bell(io_.unixEventPort, [&] { ++calls_; });
  runUntilCalls(1);

  std::thread([&] { bell.ring(); }).join();

  runUntilCalls(2);
}

}  // namespace
}  // namespace mpf::router::test
