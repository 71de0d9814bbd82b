// SPDX-License-Identifier: MIT
// A hostile server writes invalid data. Its client, which is also a client of an honest server,
// loses only that link.
#include <optional>

#include <mpf/message_client.h>

#include "tests/hostile/hostile_peer.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;

class HostileServer : public HostileTest {
 protected:
  // Sends requests to the honest server one by one, and checks each reply.
  void take(const Message& message) {
    if (message.getType() == MessageType::connect) return;
    const auto* reply = message.tryAs<Float64>();
    ASSERT_NE(reply, nullptr) << "no reply but " << toString(message.getType());
    EXPECT_EQ(reply->value, asked_ + 1.0);
    EXPECT_EQ(message.getClientExtra(), asked_);
    ++answered_;
  }
  void ask() {
    Float64Message request({.value = ++asked_ + 0.0});
    request.setClientExtra(asked_);
    ASSERT_EQ(honest_->send(std::move(request)), SendResult::sent);
    while (answered_ < asked_) dispatcher_->runOnce(Deadline::after(1s));
  }

  void TearDown() override {
    honest_.reset();
    dispatcher_.reset();
    HostileTest::TearDown();
  }

  int asked_ = 0;
  int answered_ = 0;
  std::optional<Dispatcher> dispatcher_{std::in_place, backplane_};
  std::optional<MessageClient> honest_{std::in_place, *dispatcher_,
                                       [this](const Message& message) { take(message); }};
};

// A client of the hostile server. Each request ends at most once, for all data that the server
// sends.
class Unlucky {
 public:
  explicit Unlucky(Dispatcher& dispatcher)
      : client_(dispatcher, [this](const Message& message) { take(message); }) {
    client_.bind("hostile");
  }
  void ask(int number) {
    if (client_.send(Int32Message({.value = number})) == SendResult::sent) ++accepted_;
    if (client_.send(client_.alloc<Float64Array>(500)) == SendResult::sent) ++accepted_;
  }

 private:
  void take(const Message& message) {
    if (message.getType() == MessageType::requestFate) ++fates_;
    EXPECT_LE(fates_, accepted_);
  }
  int accepted_ = 0;
  int fates_ = 0;
  MessageClient client_;
};

TEST_P(HostileServer, CostsItsClientOnlyThatLink) {
  Victim server("serve", backplane_.name());
  honest_->bind("echo");
  ASSERT_TRUE(honest_->connectWait(60s));
  ASSERT_NO_FATAL_FAILURE(ask());
  const auto before = Usage::of(::getpid());

  for (int seed = 0; seed < seeds(); ++seed) {
    {
      const HostilePeer mad("server", backplane_.name(), GetParam());
      while (!mad.hasActed()) {
        ASSERT_FALSE(mad.hasFailed());
        // a new client each time: after invalid data, a client waits a second before it reconnects
        Unlucky unlucky(*dispatcher_);
        for (int i = 0; i < 20; ++i) {
          ASSERT_NO_FATAL_FAILURE(ask());
          unlucky.ask(asked_);
        }
      }
    }
    static_cast<void>(backplane_.removeDead());
    while (!Usage::of(::getpid()).isWithin(before, kSlackKb)) ASSERT_NO_FATAL_FAILURE(ask());
  }

  EXPECT_TRUE(honest_->isConnected());
  std::cout << asked_ << " right answers; " << before << " before, " << Usage::of(::getpid())
            << " after\n";
  const auto status = server.end(SIGTERM);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}
INSTANTIATE_TEST_SUITE_P(OfEachKind, HostileServer, testing::ValuesIn(kAttacks),
                         [](const auto& parameter) { return std::string(parameter.param); });

}  // namespace
}  // namespace mpf::test
