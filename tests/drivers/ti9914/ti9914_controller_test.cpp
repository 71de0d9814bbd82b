// SPDX-License-Identifier: MIT
#include "drivers/ti9914/ti9914_controller.h"

#include <array>
#include <condition_variable>
#include <future>
#include <gmock/gmock.h>
#include <mutex>
#include <numeric>
#include <thread>

#include "tests/drivers/ti9914/ti9914_fixture.h"
#include "tests/support/sanitized.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class Ti9914ControllerTest : public Ti9914Test {
 protected:
  Ti9914ControllerTest() { start(); }

  std::string readLine(const GpibAddress& from) {
    const auto result = gpib().read(from, {.maxBytes = 100}, Deadline::never());
    EXPECT_TRUE(result.ok()) << result.reason;
    return textOf(result.data);
  }
  GpibResult send(const GpibAddress& to, std::string_view text, bool end = true) {
    return gpib().write(to, bytesOf(text), end, Deadline::never());
  }
  // The bytes of the bus as the listing of the manual shows them.
  std::string listingOf(const std::function<void()>& act) {
    std::string listing;
    std::optional<GpibDirection> direction;
    gpib().onPeek([&](std::span<const GpibPeekedByte> bytes) {
      for (const auto& byte : bytes) {
        if (direction != byte.direction) {
          listing += byte.direction == GpibDirection::sent ? "\nT" : "\nR";
          direction = byte.direction;
        }
        listing += static_cast<char>(byte.value);
        if (byte.endOrIdentify) listing += "<END>";
      }
    });
    act();
    gpib().onPeek({});
    return listing;
  }
  Ti9914Controller& gpib() { return *controller_; }
};

TEST_F(Ti9914ControllerTest, ReadsTheMeterAsTheListingOfTheManualShows) {
  const auto listing = listingOf([&] {
    EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
    EXPECT_EQ(readLine(kMeter), "-9.341735006E-01\r\n");
  });

  EXPECT_EQ(listing,
            "\nT_?V\nR-8.874270409E-01\r\n<END>"
            "\nT_?_?V\nR-9.341735006E-01\r\n<END>\nT_?");
}

TEST_F(Ti9914ControllerTest, WritesWithAndWithoutEnd) {
  EXPECT_TRUE(send(kMemory, "abc").ok());
  EXPECT_TRUE(send(kMemory, "de", false).ok());
  EXPECT_TRUE(send(kMemory, "").ok());

  EXPECT_EQ(memory_->text(), "abcde");
  EXPECT_EQ(memory_->ends, (std::vector{false, false, true, false, false}));
  EXPECT_EQ(listingOf([&] { send(kMemory, "x"); }), "\nT_?&x<END>_?");
}

TEST_F(Ti9914ControllerTest, AsksAndReadsTheAnswer) {
  ASSERT_TRUE(send(kMeter, "ID?").ok());

  EXPECT_EQ(readLine(kMeter), "HP3458A\r\n");
  EXPECT_EQ(model_->lostCommands(), 0U);
}

TEST_F(Ti9914ControllerTest, EndsAReadAtEndOrEndOfStringOrCountAndLosesNothing) {
  memory_->send("a;bc;def");

  auto result = gpib().read(kMemory, {.maxBytes = 100, .endOfString = ';'}, Deadline::never());
  EXPECT_EQ(textOf(result.data), "a;");
  EXPECT_FALSE(result.sawEnd);
  result = gpib().read(kMemory, {.maxBytes = 1}, Deadline::never());
  EXPECT_EQ(textOf(result.data), "b");
  result = gpib().read(kMemory, {.maxBytes = 3, .endOfString = '!'}, Deadline::never());
  EXPECT_EQ(textOf(result.data), "c;d");
  result = gpib().read(kMemory, {.maxBytes = 2}, Deadline::never());
  EXPECT_EQ(textOf(result.data), "ef");
  EXPECT_TRUE(result.sawEnd);
}

TEST_F(Ti9914ControllerTest, ReachesInstrumentsBySecondaryAddress) {
  second_->send("yes");

  EXPECT_TRUE(send(kSecond, "no").ok());
  EXPECT_EQ(second_->text(), "no");
  EXPECT_EQ(readLine(kSecond), "yes");
  EXPECT_EQ(send({5, 4}, "x").status, GpibStatus::noListener);
}

TEST_F(Ti9914ControllerTest, ReportsThatNoInstrumentListens) {
  const auto result = send(kNobody, "\x14");

  EXPECT_EQ(result.status, GpibStatus::noListener);
  EXPECT_THAT(result.reason, HasSubstr("instrument 9: no instrument accepts data"));
  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
  EXPECT_EQ(memory_->log, "") << "the byte must not become a command, DCL";
}

TEST_F(Ti9914ControllerTest, ReportsAnEmptyBus) {
  bus_->setFault({.at = kMeter});
  bus_->setFault({.at = kMemory});
  bus_->setFault({.at = kSecond});

  const auto result = gpib().clearAll(Deadline::never());

  EXPECT_EQ(result.status, GpibStatus::noListener);
  EXPECT_THAT(result.reason, HasSubstr("no instrument is on the bus"));
}

TEST_F(Ti9914ControllerTest, RefusesAddressesThatNoInstrumentCanHave) {
  EXPECT_EQ(send({31}, "x").status, GpibStatus::failure);
  EXPECT_EQ(gpib().read({5, 31}, {.maxBytes = 1}, soon()).status, GpibStatus::failure);
  EXPECT_EQ(gpib().serialPoll({0}, soon()).status, GpibStatus::failure);
  EXPECT_EQ(gpib().read(kMeter, {}, soon()).status, GpibStatus::failure);
}

TEST_F(Ti9914ControllerTest, ReturnsWhatCameBeforeATimeout) {
  memory_->send("abc", false);

  const auto result = gpib().read(kMemory, {.maxBytes = 100}, soon());

  EXPECT_EQ(result.status, GpibStatus::timeout);
  EXPECT_EQ(textOf(result.data), "abc");
  EXPECT_THAT(result.reason, HasSubstr("instrument 6: the instrument sent 3 bytes"));
  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
}

class EndlessTalker : public GpibInstrumentModel {
 public:
  bool receive(std::uint8_t /*byte*/, bool /*end*/) override { return true; }
  std::optional<Byte> nextByte() override { return Byte{'x', false}; }
};

TEST_F(Ti9914ControllerTest, KeepsTheDeadlineWhileATalkerNeverPauses) {
  constexpr GpibAddress kEndless{11};
  bus_->attach(kEndless, std::make_shared<EndlessTalker>());

  const auto result = gpib().read(kEndless, {.maxBytes = 4 << 20}, soon());

  EXPECT_EQ(result.status, GpibStatus::timeout);
  EXPECT_THAT(result.data, Not(testing::IsEmpty()));
  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n") << "the next call works";
}

TEST_F(Ti9914ControllerTest, NamesTheLinesAtATimeoutOfAWrite) {
  memory_->accepts = false;

  const auto result = gpib().write(kMemory,
                                   bytesOf("\x14"
                                           "bc"),
                                   true, soon());

  EXPECT_THAT(memory_->log, Not(HasSubstr("clear"))) << "the byte must not become a command, DCL";
  EXPECT_EQ(result.status, GpibStatus::timeout);
  EXPECT_THAT(result.reason, HasSubstr("data byte 1 of 3 was not accepted in time; active lines: "
                                       "DAV NRFD NDAC REN"));
  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
}

TEST_F(Ti9914ControllerTest, PollsClearsAndTriggers) {
  bus_->access([&](const GpibLines& /*lines*/) { memory_->requestService(0x05); });

  const auto poll = gpib().serialPoll(kMemory, Deadline::never());
  EXPECT_EQ(poll.statusByte, 0x45);
  EXPECT_EQ(gpib().requestsService(soon()), false);
  const std::array both{kMemory, kSecond};
  EXPECT_TRUE(gpib().trigger(both, Deadline::never()).ok());
  EXPECT_TRUE(gpib().clear(kSecond, Deadline::never()).ok());
  EXPECT_TRUE(gpib().clearAll(Deadline::never()).ok());

  EXPECT_EQ(memory_->log, "remote trigger clear ");
  EXPECT_EQ(second_->log, "remote trigger clear clear ");
}

TEST_F(Ti9914ControllerTest, SwitchesBetweenRemoteAndLocal) {
  EXPECT_TRUE(send(kMemory, "x").ok());
  EXPECT_TRUE(gpib().localLockout(Deadline::never()).ok());
  EXPECT_TRUE(gpib().goToLocal(kMemory, Deadline::never()).ok());
  EXPECT_TRUE(send(kMemory, "x").ok());
  EXPECT_TRUE(gpib().remoteEnable(false, Deadline::never()).ok());
  EXPECT_TRUE(send(kMemory, "x").ok());
  EXPECT_TRUE(gpib().remoteEnable(true, Deadline::never()).ok());
  EXPECT_TRUE(send(kMemory, "x").ok());

  EXPECT_EQ(memory_->log, "remote lockout local lockout local remote ");
}

TEST_F(Ti9914ControllerTest, KeepsRemoteEnableOverAReset) {
  ASSERT_TRUE(gpib().remoteEnable(false, Deadline::never()).ok());
  memory_->accepts = false;

  EXPECT_EQ(gpib().write(kMemory, bytesOf("x"), true, soon()).status, GpibStatus::timeout);

  EXPECT_FALSE(bus_->lines().has(gpib_line::kRen));
}

TEST_F(Ti9914ControllerTest, EndsTheHoldoffOfEachByteByAReset) {
  memory_->send("a;bc");
  EXPECT_TRUE(gpib().read(kMemory, {.maxBytes = 9, .endOfString = ';'}, Deadline::never()).ok());
  memory_->accepts = false;
  EXPECT_EQ(gpib().write(kMemory, bytesOf("x"), true, soon()).status, GpibStatus::timeout);

  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
}

TEST_F(Ti9914ControllerTest, SendsExactlyTheseCommands) {
  EXPECT_EQ(listingOf([&] {
              EXPECT_TRUE(gpib().sendCommands(bytesOf("?&"), Deadline::never()).ok());
              EXPECT_TRUE(gpib().sendCommands(bytesOf("_"), Deadline::never()).ok());
            }),
            "\nT?&_");
}

TEST_F(Ti9914ControllerTest, EndsAllAddressingByInterfaceClear) {
  ASSERT_TRUE(gpib().sendCommands(bytesOf("&"), Deadline::never()).ok());

  EXPECT_TRUE(gpib().interfaceClear(Deadline::never()).ok());

  EXPECT_TRUE(gpib().sendCommands(bytesOf("\x04"), Deadline::never()).ok());
  EXPECT_EQ(memory_->log, "remote ") << "SDC finds no listener";
}

TEST_F(Ti9914ControllerTest, CarriesEveryByteValueAndAMegabyte) {
  std::vector<std::uint8_t> data(kIsSanitized ? 1 << 16 : 1 << 20);
  std::iota(data.begin(), data.end(), 0);

  EXPECT_TRUE(gpib().write(kMemory, data, true, Deadline::never()).ok());

  EXPECT_EQ(memory_->received, data);
  for (const auto byte : data) memory_->toSend.push_back({byte, false});
  const auto result = gpib().read(kMemory, {.maxBytes = data.size()}, Deadline::never());
  EXPECT_TRUE(result.ok()) << result.reason;
  EXPECT_EQ(result.data, data);
  EXPECT_EQ(model_->lostCommands(), 0U);
}

// A handler of service requests that counts.
class RequestCount {
 public:
  explicit RequestCount(GpibController& gpib) : gpib_(gpib) {
    EXPECT_TRUE(gpib_.onServiceRequest([this] {
      const std::lock_guard lock(mutex_);
      ++count_;
      changed_.notify_all();
    }));
  }
  ~RequestCount() { gpib_.onServiceRequest({}); }
  RequestCount(const RequestCount&) = delete;
  RequestCount& operator=(const RequestCount&) = delete;
  void waitFor(int count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return count_ >= count; });
  }

 private:
  GpibController& gpib_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int count_ = 0;
};

TEST_F(Ti9914ControllerTest, ReportsServiceRequestsWhileItIsIdle) {
  RequestCount requests(gpib());

  bus_->access([&](const GpibLines& /*lines*/) { memory_->requestService(0); });

  requests.waitFor(1);
  EXPECT_EQ(gpib().requestsService(soon()), true);
}

TEST_F(Ti9914ControllerTest, ReportsServiceRequestsDuringOperations) {
  RequestCount requests(gpib());
  ASSERT_TRUE(send(kMeter, "RQS 128;TRIG HOLD").ok());

  ASSERT_TRUE(gpib().trigger({&kMeter, 1}, Deadline::never()).ok());

  requests.waitFor(1);
  EXPECT_EQ(gpib().serialPoll(kMeter, Deadline::never()).statusByte,
            kGpibRequestsService | MeterModel::kDataAvailable | MeterModel::kReady);
}

TEST_F(Ti9914ControllerTest, WaitsForAnInstrumentThatIsSlow) {
  auto reading = std::async(std::launch::async, [&] { return readLine(kMemory); });

  for (const auto* part : {"1", ".", "5"})
    bus_->access([&](const GpibLines& /*lines*/) { memory_->send(part, *part == '5'); });

  EXPECT_EQ(reading.get(), "1.5");
}

TEST_F(Ti9914ControllerTest, WorksWhenInterruptsAreLost) {
  carrier_.setFault("IP_a", ModelFault::interruptsLost);
  RequestCount requests(gpib());
  auto reading = std::async(std::launch::async, [&] { return readLine(kMemory); });

  bus_->access([&](const GpibLines& /*lines*/) {
    memory_->send("late");
    second_->requestService(0);
  });

  EXPECT_EQ(reading.get(), "late");
  requests.waitFor(1);
}

TEST_F(Ti9914ControllerTest, ReportsAModuleThatIsAbsentAndUsesItAgain) {
  carrier_.setFault("IP_a", ModelFault::busError);

  auto result = send(kMemory, "x");
  EXPECT_EQ(result.status, GpibStatus::failure);
  EXPECT_THAT(result.reason, HasSubstr("a-ip488"));
  EXPECT_EQ(gpib().requestsService(soon()), std::nullopt);
  EXPECT_EQ(gpib().interfaceClear(soon()).status, GpibStatus::failure);
  EXPECT_EQ(gpib().remoteEnable(true, soon()).status, GpibStatus::failure);

  carrier_.setFault("IP_a", ModelFault::none);

  EXPECT_EQ(readLine(kMeter), "-8.874270409E-01\r\n");
}

TEST_F(Ti9914ControllerTest, ReportsARequestThatBeganWhileTheModuleWasAbsent) {
  RequestCount requests(gpib());
  carrier_.setFault("IP_a", ModelFault::busError);
  EXPECT_EQ(send(kMemory, "x").status, GpibStatus::failure);
  bus_->access([&](const GpibLines& /*lines*/) { second_->requestService(0); });
  carrier_.setFault("IP_a", ModelFault::none);

  EXPECT_TRUE(send(kMemory, "x").ok());

  requests.waitFor(1);
}

TEST_F(Ti9914ControllerTest, NamesItselfByModuleAndPlace) {
  EXPECT_EQ(gpib().description(), "TI9914 a-ip488 (carrier ipac, site IP_a)");
}

TEST_F(Ti9914Test, CannotStartWithoutTheModule) {
  modules_.create("a-ip488", "ipac", "IP_a", kIp488);
  carrier_.unplug("IP_a");

  EXPECT_THROW(controller_.emplace(*modules_.find("a-ip488"), Ti9914Chip::Options{}),
               std::runtime_error);
}

}  // namespace
}  // namespace mpf::test
