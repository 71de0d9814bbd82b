// SPDX-License-Identifier: MIT
#include "drivers/gpib/prologix_model.h"

#include <sys/socket.h>

#include <array>
#include <gtest/gtest.h>
#include <string>

#include "base/system_call.h"
#include "tests/drivers/gpib/echo_instrument.h"
#include "tests/drivers/gpib/gpib_test_values.h"

namespace mpf::test {
namespace {

class PrologixModelTest : public testing::Test {
 protected:
  PrologixModelTest() {
    model_.attach(kEcho, echo_);
    plugIn();
  }
  void plugIn() {
    std::array<int, 2> ends{};
    checkCall(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), "socketpair");
    line_.reset(ends[0]);
    model_.connect(FileDescriptor(ends[1]));
  }
  void enter(std::string_view text) const {
    EXPECT_EQ(::send(line_.get(), text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  // The next `length` bytes; fewer when the model hangs up.
  [[nodiscard]] std::string receive(std::size_t length) const {
    std::string bytes(length, '\0');
    const auto got = ::recv(line_.get(), bytes.data(), length, MSG_WAITALL);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }

  std::shared_ptr<EchoInstrument> echo_ = std::make_shared<EchoInstrument>();
  FileDescriptor line_;
  PrologixModel model_;
};

TEST_F(PrologixModelTest, AnswersOnItsLine) {
  enter("++auto 0\n++eos 3\n++addr 22\nabc\n++read eoi\n++addr\n");

  EXPECT_EQ(receive(7), "abc22\r\n");
}

TEST_F(PrologixModelTest, CutsTheConnectionOnRequest) {
  model_.behave({.cutsConnection = true});
  enter("++addr\n");

  EXPECT_EQ(receive(1), "");
}

TEST_F(PrologixModelTest, IsSilentOnRequest) {
  model_.behave({.isSilent = true});
  enter("++addr\n");
  model_.hangUp();

  EXPECT_EQ(receive(1), "");
}

TEST_F(PrologixModelTest, SendsGarbageAndAnotherVersionOnRequest) {
  model_.behave({.version = "Toaster", .garbage = "!"});
  enter("++ver\n");

  EXPECT_EQ(receive(10), "!Toaster\r\n");
}

TEST_F(PrologixModelTest, WaitsBeforeItExecutesALineOnRequest) {
  const auto begin = Clock::nowNs();
  model_.behave({.delay = std::chrono::milliseconds(20)});
  enter("++addr\n");

  EXPECT_EQ(receive(3), "0\r\n");
  EXPECT_GE(Clock::nowNs() - begin, 20'000'000);
}

TEST_F(PrologixModelTest, ServesANewLineAfterAnEndlessRead) {
  echo_->neverEnds = true;
  enter("++addr 22\n++read eoi\n");
  EXPECT_EQ(receive(5), "xxxxx");

  plugIn();
  enter("++addr\n");

  EXPECT_EQ(receive(4), "22\r\n");
}

}  // namespace
}  // namespace mpf::test
