// SPDX-License-Identifier: MIT
// Many clients of one bus: replies, deadlines, leases, clients that leave.
#include "server/programs/gpib_server/gpib_server.h"

#include <cstdlib>
#include <numeric>
#include <thread>

#include "tests/server/programs/gpib_server/gpib_fixture.h"
#include "tests/support/caller.h"
#include "tests/support/sanitized.h"
#include "tests/support/victim.h"

namespace mpf::test {
namespace {

using namespace gpib;
using namespace std::chrono_literals;
using testing::Contains;
using testing::Not;

// $MPF_TEST_GPIB_TRANSACTIONS, of all clients together.
int transactions() {
  const auto* const text = std::getenv("MPF_TEST_GPIB_TRANSACTIONS");
  if (text != nullptr) return std::atoi(text);
  return kIsSanitized ? 2'000 : 20'000;
}

TEST_F(GpibServerTest, AWriteReadReturnsEveryByteValue) {
  GpibAsker asker(backplane_);
  std::string bytes(256, '\0');
  std::iota(bytes.begin(), bytes.end(), '\0');

  EXPECT_EQ(asker.ask(patient(cmdWriteRead), bytes),
            (GpibAnswer{gpibStatusOK, gpibReadEndedByEnd, bytes}));
}

TEST_F(GpibServerTest, AMebibyteIsTransferred) {
  GpibAsker asker(backplane_);
  std::string bytes(1 << 20, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 7 + i / 251);

  EXPECT_EQ(asker.ask(patient(cmdWrite), bytes).status, gpibStatusOK);
  const auto answer = asker.ask(patient(cmdRead));

  EXPECT_EQ(answer.status, gpibStatusOK);
  EXPECT_TRUE(answer.text == bytes);
}

TEST_F(GpibServerTest, ARequestThatIsInvalidOrOfAnotherTypeDoesNothing) {
  GpibAsker asker(backplane_);
  const auto before = fake_.operations();

  EXPECT_EQ(asker.ask(patient(cmdRead, 31)).status, gpibStatusInvalid);
  EXPECT_EQ(asker.ask(patient(99)).status, gpibStatusInvalid);
  auto number = asker.client().call(Float64Message(), 60s);

  ASSERT_NE(number.message().tryAs<Float64>(), nullptr);
  EXPECT_EQ(number.message().tryAs<Float64>()->status, -1);
  EXPECT_EQ(fake_.operations(), before);
}

// Each answer is what its own request has written: nothing came between the two.
TEST_F(GpibServerTest, NoTransactionsOfTenClientsAreInterleaved) {
  constexpr int kClients = 10;
  const int each = transactions() / kClients;
  std::vector<std::thread> clients;
  for (int client = 0; client < kClients; ++client) {
    clients.emplace_back([this, client, each] {
      GpibAsker asker(backplane_);
      for (int i = 0; i < each; ++i) {
        const auto text = std::to_string(client) + ":" + std::to_string(i);
        ASSERT_EQ(asker.ask(patient(cmdWriteRead), text),
                  (GpibAnswer{gpibStatusOK, gpibReadEndedByEnd, text}));
      }
    });
  }
  for (auto& client : clients) client.join();
}

// ---- deadlines

TEST_F(GpibServerTest, ARequestEndsAtItsTimeoutWhileAnInstrumentHangs) {
  fake_.hang({5});
  GpibAsker hanging(backplane_);
  GpibAsker other(backplane_);
  hanging.send(patient(cmdWrite, 5), "x");
  fake_.waitForHanging();

  const auto answer = other.ask(within(5, cmdWriteRead), "y");

  EXPECT_EQ(answer, (GpibAnswer{gpibStatusTimeout, 0, ""}));
  EXPECT_FALSE(hasOperation("write 22"));
  fake_.letGo();
  EXPECT_EQ(other.ask(patient(cmdWriteRead), "z").text, "z");
}

TEST_F(GpibServerTest, FourClientsGoOnBesideOneWhoseInstrumentHangs) {
  fake_.hang({5});
  std::atomic<int> working{4};
  std::thread hanging([&] {
    GpibAsker asker(backplane_);
    while (working > 0) ASSERT_EQ(asker.ask(within(2, cmdRead, 5)).status, gpibStatusTimeout);
  });
  std::vector<std::thread> clients;
  for (int client = 1; client <= 4; ++client) {
    clients.emplace_back([&, client] {
      GpibAsker asker(backplane_);
      for (int i = 0; i < 50; ++i) {
        const auto text = std::to_string(i);
        ASSERT_EQ(asker.ask(patient(cmdWriteRead, client), text).text, text);
      }
      --working;
    });
  }
  for (auto& client : clients) client.join();
  hanging.join();
}

// ---- leases

TEST_F(GpibServerTest, ALeaseExcludesOthersAndNamesItsHolder) {
  GpibAsker holder(backplane_);
  GpibAsker other(backplane_);
  EXPECT_EQ(other.ask(patient(cmdLeaseHolder)), (GpibAnswer{gpibStatusOK, 0, ""}));
  ASSERT_EQ(holder.ask(leaseFor(3'600'000), "scan").status, gpibStatusOK);

  const auto seen = other.ask(patient(cmdLeaseHolder));
  EXPECT_EQ(seen.text, "scan");
  EXPECT_GT(seen.extra, 1'800'000);
  EXPECT_EQ(holder.ask(patient(cmdWriteRead), "mine").text, "mine");
  EXPECT_EQ(other.ask(within(5, cmdWrite), "theirs"), (GpibAnswer{gpibStatusLeased, 0, "scan"}));
  EXPECT_EQ(other.ask(within(5, cmdUnlease)).status, gpibStatusLeased);
  ASSERT_EQ(holder.ask(patient(cmdUnlease)).status, gpibStatusOK);

  EXPECT_EQ(other.ask(patient(cmdWriteRead), "theirs").text, "theirs");
}

TEST_F(GpibServerTest, ALeaseEndsAtItsTimeLimit) {
  GpibAsker holder(backplane_);
  GpibAsker other(backplane_);
  ASSERT_EQ(holder.ask(leaseFor(20)), (GpibAnswer{gpibStatusOK, 20, ""}));

  EXPECT_EQ(other.ask(patient(cmdWriteRead), "x").text, "x");
}

TEST_F(GpibServerTest, ALeaseEndsWhenItsHolderIsKilledOrDisconnects) {
  GpibAsker other(backplane_);
  Victim killed("lease", backplane_.name(), {"gpib"});
  ASSERT_EQ(killed.line(), "leased");
  EXPECT_EQ(other.ask(within(5, cmdWrite), "x").status, gpibStatusLeased);

  killed.end(SIGKILL);

  EXPECT_EQ(other.ask(patient(cmdWriteRead), "y").text, "y");
  auto leaving = std::make_unique<GpibAsker>(backplane_);
  ASSERT_EQ(leaving->ask(leaseFor(86'400'000)).status, gpibStatusOK);

  leaving.reset();

  EXPECT_EQ(other.ask(patient(cmdWriteRead), "z").text, "z");
}

TEST_F(GpibServerTest, ALeaseEndsWithItsHolderWhileAnInstrumentHangs) {
  GpibAsker other(backplane_);
  fake_.hang({5});
  {
    GpibAsker holder(backplane_);
    ASSERT_EQ(holder.ask(leaseFor(86'400'000)).status, gpibStatusOK);
    holder.send(patient(cmdWrite, 5), "begun");
    fake_.waitForHanging();
    holder.send(patient(cmdWrite, 6), "not begun");
  }

  while (!other.ask(patient(cmdLeaseHolder)).text.empty()) std::this_thread::yield();

  other.ask(patient(cmdLeaseHolder));  // the server has finished with the dead client
  fake_.letGo();
  EXPECT_EQ(other.ask(patient(cmdWriteRead), "x").text, "x");
  EXPECT_FALSE(hasOperation("write 6"));
}

// ---- the end of the server

TEST(GpibServerEnd, RequestsThatHaveNotBegunAreRefused) {
  const Watchdog watchdog("GPIB server test");
  const ServerLog log("test", "off");
  FakeGpib fake;
  GpibBus bus(fake.makeController());
  const TestBackplane backplane;
  MessageServer server(backplane, "gpib");
  auto served = std::make_unique<GpibServer>(server, bus, GpibLimits{.maxTimeout = 24h}, log);
  served->start([] { FAIL() << "the server failed"; });
  fake.hang({5});
  GpibAsker hanging(backplane);
  hanging.send({.timeout = 36'000, .cmd = cmdWrite, .address = 5}, "x");
  fake.waitForHanging();
  Dispatcher dispatcher(backplane);
  Caller other(dispatcher, "gpib", 0);
  while (!other.isConnected()) dispatcher.runOnce(Deadline::never());
  for (const auto cmd : {cmdWrite, cmdLeaseHolder}) {
    auto message = Char8ArrayMessage::allocValue(0);
    *message = {.timeout = 36'000, .cmd = cmd, .address = 6};
    other.send(std::move(message));
  }
  while (other.messages.empty()) dispatcher.runOnce(Deadline::never());
  EXPECT_NE(other.take().tryAs<Char8Array>(), nullptr);  // so the server has the write, too

  served->stop();
  fake.letGo();
  served.reset();

  while (other.messages.empty()) dispatcher.runOnce(Deadline::never());
  EXPECT_EQ(fateOf(other.take()), Fate::refused);
  EXPECT_THAT(fake.operations(), Not(Contains("write 6")));
}

}  // namespace
}  // namespace mpf::test
