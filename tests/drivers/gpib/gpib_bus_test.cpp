// SPDX-License-Identifier: MIT
// GpibBus over a fake controller, which checks that operations do not overlap.
#include <mpf/drivers/gpib/gpib_bus.h>

#include <array>
#include <gmock/gmock.h>
#include <thread>

#include "tests/drivers/gpib/fake_controller.h"
#include "tests/support/watchdog.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class GpibBusTest : public testing::Test {
 protected:
  static Deadline later() { return Deadline::after(60s); }
  GpibResult write(std::string_view text, GpibAddress to = {22}) {
    return bus_.write(to, bytesOf(text), later());
  }

  Watchdog watchdog_{"GPIB bus test"};
  FakeGpib fake_;
  GpibBus bus_{fake_.makeController(), {.pollServiceRequestEvery = 1ms}};
};

TEST_F(GpibBusTest, TakesChargeOfTheBusAtItsStart) {
  EXPECT_THAT(fake_.operations(), ElementsAre("interface clear", "remote on"));
  EXPECT_EQ(bus_.description(), "fake controller");
}

TEST(GpibBusStart, FailsWithTheReasonOfTheController) {
  FakeGpib fake;
  fake.startResult = {GpibStatus::timeout, "no answer"};
  try {
    const GpibBus bus(fake.makeController());
    ADD_FAILURE() << "it started";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "fake controller cannot start, interface clear failed: no answer");
  }
}

TEST(GpibBusStart, AcceptsAControllerWithoutInterfaceClear) {
  FakeGpib fake;
  fake.startResult = {GpibStatus::unsupported, "USB has no such line"};
  EXPECT_NO_THROW(GpibBus(fake.makeController()));
}

TEST_F(GpibBusTest, WriteReadReturnsTheAnswer) {
  const auto answer = bus_.writeRead({22}, bytesOf("ID?"), {.maxBytes = 100}, later());

  EXPECT_TRUE(answer.ok());
  EXPECT_EQ(textOf(answer.data), "ID?");
  EXPECT_TRUE(answer.sawEnd);
}

TEST_F(GpibBusTest, AReadEndsAtItsLimits) {
  ASSERT_TRUE(write("one\ntwo").ok());

  EXPECT_EQ(textOf(bus_.read({22}, {.maxBytes = 2}, later()).data), "on");
  EXPECT_EQ(textOf(bus_.read({22}, {.maxBytes = 99, .endOfString = '\n'}, later()).data), "one\n");
}

TEST_F(GpibBusTest, EachOperationReachesTheController) {
  const std::array group{GpibAddress{1}, GpibAddress{2, 3}};
  EXPECT_TRUE(bus_.sendCommands(bytesOf("_?"), later()).ok());
  EXPECT_TRUE(bus_.serialPoll({22}, later()).ok());
  EXPECT_TRUE(bus_.clearAll(later()).ok());
  EXPECT_TRUE(bus_.clear({22}, later()).ok());
  EXPECT_TRUE(bus_.trigger(group, later()).ok());
  EXPECT_TRUE(bus_.interfaceClear(later()).ok());
  EXPECT_TRUE(bus_.remoteEnable(false, later()).ok());
  EXPECT_EQ(bus_.localLockout(later()).status, GpibStatus::unsupported);
  EXPECT_EQ(bus_.goToLocal({22}, later()).status, GpibStatus::noListener);

  EXPECT_THAT(
      fake_.operations(),
      ElementsAre("interface clear", "remote on", "commands _?", "poll 22", "clear all", "clear 22",
                  "trigger 1 203", "interface clear", "remote off", "lockout", "local 22"));
}

TEST_F(GpibBusTest, AWriteThatFailsIsNotFollowedByTheRead) {
  fake_.hang({22});

  const auto answer = bus_.writeRead({22}, bytesOf("ID?"), {.maxBytes = 100}, Deadline::after(5ms));

  EXPECT_EQ(answer.status, GpibStatus::timeout);
  EXPECT_THAT(fake_.operations(), testing::Not(testing::Contains("read 22")));
}

// Each read must find what its own write has left.
TEST_F(GpibBusTest, NothingComesBetweenAWriteAndItsRead) {
  std::vector<std::thread> users;
  for (int user = 0; user < 4; ++user) {
    users.emplace_back([this, user] {
      for (int i = 0; i < 500; ++i) {
        const auto text = std::to_string(user) + ":" + std::to_string(i);
        const auto answer = bus_.writeRead({22}, bytesOf(text), {.maxBytes = 100}, later());
        ASSERT_EQ(textOf(answer.data), text);
      }
    });
  }
  for (auto& user : users) user.join();
}

TEST_F(GpibBusTest, AnInstrumentThatHangsDelaysOthersUntilItsDeadlineOnly) {
  fake_.hang({5});
  EXPECT_EQ(bus_.write({5}, bytesOf("x"), Deadline::after(5ms)).status, GpibStatus::timeout);
  EXPECT_TRUE(write("y").ok());
}

TEST_F(GpibBusTest, OthersWaitForTheBusUntilTheirOwnDeadline) {
  fake_.hang({5});
  std::thread hanging([&] { EXPECT_EQ(write("x", {5}).status, GpibStatus::timeout); });
  fake_.waitForHanging();

  const auto impatient = bus_.write({22}, bytesOf("y"), Deadline::after(1ms));
  fake_.letGo();
  const auto patient = write("z");

  EXPECT_EQ(impatient.status, GpibStatus::timeout);
  EXPECT_THAT(impatient.reason, HasSubstr("has not begun"));
  EXPECT_TRUE(patient.ok());
  hanging.join();
}

TEST_F(GpibBusTest, ALeaseMakesASequenceExclusive) {
  ASSERT_TRUE(bus_.lease(7, "scan", 60s, later()).ok());
  ASSERT_TRUE(bus_.leaseHolder());
  EXPECT_EQ(bus_.leaseHolder()->name, "scan");

  EXPECT_TRUE(bus_.write({22}, bytesOf("mine"), later(), 7).ok());
  EXPECT_EQ(bus_.write({22}, bytesOf("other"), Deadline::after(1ms)).status, GpibStatus::leased);
  EXPECT_EQ(textOf(bus_.read({22}, {.maxBytes = 9}, later(), 7).data), "mine");
  bus_.release(7);

  EXPECT_TRUE(write("other").ok());
}

// ---- service requests

TEST_F(GpibBusTest, AServiceRequestCallsItsHandlerWhichMayUseTheBus) {
  std::atomic<int> status{0};
  // A line that is found active and also reported calls the handler twice. The first serial poll
  // ends the request.
  const auto subscription = bus_.onServiceRequest([&] {
    const auto polled = bus_.serialPoll({22}, later()).statusByte;
    if ((polled & kGpibRequestsService) != 0) status = polled;
  });

  fake_.setStatus({22}, kGpibRequestsService | 1);

  while (status != (kGpibRequestsService | 1)) std::this_thread::yield();
}

TEST(GpibBusPolled, AControllerThatDoesNotReportIsPolledWhileThereAreHandlers) {
  const Watchdog watchdog("GPIB bus test");
  FakeGpib fake;
  fake.reportsItself = false;
  GpibBus bus(fake.makeController(), {.pollServiceRequestEvery = 1ms});
  ASSERT_TRUE(bus.lease(7, "a lease does not hide the line", 60s, Deadline::after(60s)).ok());
  std::atomic<int> calls{0};
  EXPECT_EQ(fake.linePolls, 0);

  {
    const auto subscription = bus.onServiceRequest([&] { ++calls; });
    while (fake.linePolls < 2) std::this_thread::yield();
    EXPECT_EQ(calls, 0);
    fake.setStatus({22}, kGpibRequestsService);
    while (calls < 2) std::this_thread::yield();  // as long as it is active
  }

  const int polls = fake.linePolls;
  std::this_thread::sleep_for(10ms);
  EXPECT_LE(fake.linePolls, polls + 1);
}

// ---- taps

TEST_F(GpibBusTest, TapsSeeEachByte) {
  std::string seen;
  {
    const auto look = [&](std::span<const GpibPeekedByte> bytes) {
      for (const auto& byte : bytes) {
        seen += byte.direction == GpibDirection::sent ? 'T' : 'R';
        seen += static_cast<char>(byte.value);
        if (byte.endOrIdentify) seen += '!';
      }
    };
    const auto one = bus_.attachTap(look);
    const auto other = bus_.attachTap([](auto) {});
    ASSERT_TRUE(bus_.writeRead({22}, bytesOf("ab"), {.maxBytes = 9}, later()).ok());
    EXPECT_TRUE(fake_.isPeeking());
  }

  EXPECT_EQ(seen, "TaTb!RaRb!");
  ASSERT_TRUE(write("unseen").ok());
  EXPECT_EQ(seen, "TaTb!RaRb!");
  EXPECT_FALSE(fake_.isPeeking());
}

}  // namespace
}  // namespace mpf::test
