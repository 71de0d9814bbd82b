// SPDX-License-Identifier: MIT
// Every message is echoed unchanged: on hosts of each byte order, and between them. `make
// test-big-endian` sets MPF_TEST_BIG_ENDIAN to a build for the other byte order; without it, only
// the tests for hosts of this byte order run.
#include <cstdlib>
#include <gmock/gmock.h>
#include <memory>
#include <string>
#include <vector>

#include "schema/text.h"
#include "tests/byte_order/talk.h"
#include "tests/support/every_message.h"
#include "tests/support/program.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace {

using namespace mpf;
using test::Program;
using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

enum class Order { ours, other };

// Programs on one backplane, of this build or of the build for the other byte order.
class Host {
 public:
  Host(Order order, const Backplane& backplane) : order_(order), backplane_(backplane.name()) {}

  [[nodiscard]] const std::string& backplane() const noexcept { return backplane_; }
  [[nodiscard]] std::unique_ptr<Program> start(const std::string& program,
                                               const std::vector<std::string>& arguments) const {
    const std::string build = order_ == Order::ours ? "" : std::getenv("MPF_TEST_BIG_ENDIAN");
    std::vector<std::string> command{(build.empty() ? MPF_TEST_PROGRAMS : build + "/bin") +
                                     ("/" + program)};
    if (!build.empty()) command.insert(command.begin(), build + "/run");
    command.insert(command.end(), arguments.begin(), arguments.end());
    return std::make_unique<Program>(command);
  }
  [[nodiscard]] std::unique_ptr<Program> startEcho() const {
    auto echo = start("mpf_test_echo", {backplane_, kServer, kLocation});
    EXPECT_EQ(echo->line(), "serving");
    return echo;
  }
  [[nodiscard]] std::unique_ptr<Program> startAsker() const {
    return start("mpf_test_ask", {backplane_, kServer, kLocation});
  }

  static constexpr auto kServer = "echo";
  static constexpr auto kLocation = "66051";  // 0x00010203

 private:
  Order order_;
  std::string backplane_;
};

// The rest of the line of `program` after `text`; waits for a line that contains it.
std::string after(const Program& program, const std::string& text) {
  const auto line = program.waitForLine(text);
  if (const auto at = line.find(text); at != std::string::npos)
    return line.substr(at + text.size());
  ADD_FAILURE() << "the program exited without printing: " << text;
  return {};
}

std::vector<std::string> lines(const Program& program, std::size_t count) {
  std::vector<std::string> all;
  while (all.size() < count) all.push_back(program.line());
  return all;
}

std::vector<std::string> allRight() {
  std::vector<std::string> lines;
  for (const auto& message : test::everyRequest()) lines.push_back("right: " + print(message));
  return lines;
}

// mpf_test_ask on one host, mpf_test_echo on the other or on the same host.
void expectEverythingThereAndBack(const Host& near, const Host& far) {
  const auto right = allRight();
  const auto asker = near.startAsker();
  auto echo = far.startEcho();

  EXPECT_EQ(asker->line(), "connectYes");
  EXPECT_THAT(lines(*asker, right.size()), ElementsAreArray(right));
  EXPECT_THAT(lines(*echo, right.size()), ElementsAreArray(right));
  EXPECT_EQ(asker->line(),
            print(MessageOf(test::withStandardFields(OutOfBand{.value = 0x01020304}))));
  EXPECT_EQ(asker->line(), "fate refused");
  EXPECT_EQ(asker->line(), "the queue is full");
  echo->signal(SIGUSR1);
  EXPECT_EQ(asker->line(), "each request has ended");
  EXPECT_EQ(asker->line(), "it will die");
  echo->signal(SIGUSR1);
  EXPECT_THAT(lines(*asker, 3),
              UnorderedElementsAre("fate outcomeUnknown", "fate neverTaken", "fate neverTaken"));
  EXPECT_EQ(asker->line(), "connectNo");
  EXPECT_EQ(WEXITSTATUS(echo->wait()), 0);
  echo = far.startEcho();
  EXPECT_EQ(asker->line(), "connectYes");
  EXPECT_EQ(asker->errors(), "");
}

struct Hosts {
  const char* name;
  Order near, far;
};

class ByteOrder : public testing::TestWithParam<Hosts> {
 protected:
  void SetUp() override {
    if (needsOther() && std::getenv("MPF_TEST_BIG_ENDIAN") == nullptr)
      GTEST_SKIP() << "no build for the other byte order: make test-big-endian";
  }
  // Only a program of the same byte order can judge the files of a killed program. It does so when
  // it attaches.
  void TearDown() override {
    if (!needsOther() || IsSkipped()) return;
    for (const auto* backplane : {&nearBackplane_, &farBackplane_}) {
      const auto another =
          Host(Order::other, *backplane)
              .start("mpf_test_ask", {backplane->name(), "nobody", Host::kLocation, "why"});
      EXPECT_THAT(another->line(), HasSubstr("\"nobody\""));
    }
  }
  static bool needsOther() {
    return GetParam().near == Order::other || GetParam().far == Order::other;
  }
  const test::Watchdog watchdog_{"a host of another byte order"};
  const test::TestBackplane nearBackplane_;
  const test::TestBackplane farBackplane_;
};

class OneHost : public ByteOrder {};
class TwoHosts : public ByteOrder {};
class ForeignWindow : public ByteOrder {};

TEST_P(OneHost, EchoesEveryMessageUnchanged) {
  const Host host(GetParam().near, nearBackplane_);

  expectEverythingThereAndBack(host, host);
}

TEST_P(TwoHosts, EchoEveryMessageUnchanged) {
  const Host near(GetParam().near, nearBackplane_);
  const Host far(GetParam().far, farBackplane_);
  const auto serving =
      far.start("mpf-router", {"--backplane", far.backplane(), "--serve", Host::kLocation,
                               "--listen", "127.0.0.1:0", "--plain"});
  const auto address = after(*serving, "listening on ");
  const auto calling =
      near.start("mpf-router", {"--backplane", near.backplane(), "--remote",
                                std::string(Host::kLocation) + "=" + address, "--plain"});

  expectEverythingThereAndBack(near, far);
}

// Segments of the other byte order, which a program under an emulator creates, are refused by name
// and not changed.
TEST_P(ForeignWindow, IsRefusedByName) {
  const Host one(GetParam().near, nearBackplane_);
  const Host other(GetParam().far, nearBackplane_);
  const auto right = allRight();
  const auto echo = one.startEcho();

  const auto second =
      other.start("mpf_test_echo", {other.backplane(), Host::kServer, Host::kLocation});
  const auto client =
      other.start("mpf_test_ask", {other.backplane(), Host::kServer, Host::kLocation, "why"});

  EXPECT_THAT(second->line(), HasSubstr("wrong magic number"));
  EXPECT_THAT(client->line(), HasSubstr("wrong magic number"));
  const auto asker = one.startAsker();
  EXPECT_EQ(asker->line(), "connectYes");
  EXPECT_THAT(lines(*asker, right.size()), ElementsAreArray(right));
}

constexpr auto kName = [](const auto& info) { return std::string(info.param.name); };
INSTANTIATE_TEST_SUITE_P(Of, OneHost,
                         testing::Values(Hosts{"OurByteOrder", Order::ours, Order::ours},
                                         Hosts{"TheOther", Order::other, Order::other}),
                         kName);
INSTANTIATE_TEST_SUITE_P(Of, TwoHosts,
                         testing::Values(Hosts{"OurByteOrder", Order::ours, Order::ours},
                                         Hosts{"TheOtherFar", Order::ours, Order::other},
                                         Hosts{"TheOtherNear", Order::other, Order::ours},
                                         Hosts{"TheOther", Order::other, Order::other}),
                         kName);
INSTANTIATE_TEST_SUITE_P(Of, ForeignWindow,
                         testing::Values(Hosts{"OurByteOrder", Order::ours, Order::other},
                                         Hosts{"TheOther", Order::other, Order::ours}),
                         kName);

}  // namespace
