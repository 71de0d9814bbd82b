// SPDX-License-Identifier: MIT
// The databases of epics/db, with servers that keep the requests.
#include <algorithm>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include <mpf/ip330_commands.h>
#include <mpf/serial_commands.h>

#include "tests/epics/epics_fixture.h"

namespace mpf::test {
namespace {

std::string databaseText(const std::string& name) {
  std::ifstream file(std::string(MPF_TEST_DATABASES) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class Array, class Value>
void replyArray(MessageServer& self, const Message& request, const std::vector<Value>& values) {
  auto reply = self.allocReplyMessage<Array>(request, values.size());
  std::ranges::copy(values, reply.value().begin());
  static_cast<void>(self.reply(std::move(reply)));
}

class DatabasesTest : public EpicsTest {
 protected:
  void remember(std::int32_t command, double value) {
    const std::lock_guard lock(mutex_);
    values_[command] = value;
  }
  // Remembers the value of a command of a Float64 server, and replies.
  void take(MessageServer& self, Message&& request) {
    const auto* fields = request.tryAs<Float64>();
    remember(fields->cmd, fields->value);
    static_cast<void>(self.reply(std::move(request)));
  }
  // Waits until the server has received the command, and returns its value.
  double valueOf(std::int32_t command) {
    for (;; std::this_thread::yield()) {
      const std::lock_guard lock(mutex_);
      if (const auto found = values_.find(command); found != values_.end()) return found->second;
    }
  }

 private:
  std::mutex mutex_;
  std::map<std::int32_t, double> values_;
};

TEST_F(DatabasesTest, SweepStartsStopsErasesAndReads) {
  const ThreadServer server(backplane_, "sweep", [this](MessageServer& self, Message&& request) {
    const auto* fields = request.tryAs<Float64>();
    if (fields->cmd == ip330server::msgGetAcqStatus)
      return replyArray<Float64Array, double>(self, request, {1, 2.5, 2.5, 0, 0.125});
    if (fields->cmd == ip330server::msgRead) {
      remember(fields->cmd, fields->address);
      return replyArray<Int32Array, std::int32_t>(self, request, {7, -8, 9});
    }
    take(self, std::move(request));
  });
  const Ioc ioc(databaseText("ip330_sweep.db"),
                "P=lab:,R=adc,SERVER=sweep,CHANNEL=3,POINTS=4,SCAN=.1 second");

  Ioc::waitFor("lab:adcData.NORD", "3");
  Ioc::waitFor("lab:adcElapsed", "2.500");
  EXPECT_EQ(Ioc::get("lab:adcAcquiring"), "Acquiring");
  EXPECT_EQ(Ioc::get("lab:adcDwellActual"), "0.125000");
  EXPECT_EQ(Ioc::get("lab:adcData"), "7");
  EXPECT_EQ(valueOf(ip330server::msgRead), 3) << "the channel";

  EXPECT_EQ(Ioc::put("lab:adcPoints", "4"), 0);
  EXPECT_EQ(Ioc::put("lab:adcDwell", "0.25"), 0);
  EXPECT_EQ(Ioc::put("lab:adcPreset", "1.5"), 0);
  EXPECT_EQ(Ioc::put("lab:adcEraseStart.PROC", "1"), 0);
  EXPECT_EQ(Ioc::put("lab:adcStop.PROC", "1"), 0);

  EXPECT_EQ(valueOf(ip330server::msgSetNChan), 4);
  EXPECT_EQ(valueOf(ip330server::msgSetDwell), 0.25);
  EXPECT_EQ(valueOf(ip330server::msgSetRealTime), 1.5);
  static_cast<void>(valueOf(ip330server::msgErase));
  static_cast<void>(valueOf(ip330server::msgAcquire));
  static_cast<void>(valueOf(ip330server::msgStopAcquisition));
}

TEST_F(DatabasesTest, PidWritesItsParametersAndReadsItsState) {
  const ThreadServer server(backplane_, "pid", [this](MessageServer& self, Message&& request) {
    if (request.tryAs<Float64>()->cmd == ip330server::cmdGetParams)
      return replyArray<Float64Array, double>(self, request, {1, 2, 3, 4, 5, 6, 7});
    take(self, std::move(request));
  });
  const Ioc ioc(databaseText("ip330_pid.db"), "P=lab:,R=pid,SERVER=pid,SCAN=.1 second,PREC=1");
  const std::vector<std::string> states{
      "Actual", "Error", "Output", "P", "I", "D", "SecondsPerScanActual"};
  const std::map<std::string, std::int32_t> outputs{
      {"SetPoint", ip330server::cmdSetSetPoint},
      {"KP", ip330server::cmdSetKP},
      {"KI", ip330server::cmdSetKI},
      {"KD", ip330server::cmdSetKD},
      {"LowLimit", ip330server::cmdSetLowLimit},
      {"HighLimit", ip330server::cmdSetHighLimit},
      {"SecondsPerScan", ip330server::cmdSetSecondsPerScan}};

  for (std::size_t i = 0; i < states.size(); ++i)
    Ioc::waitFor("lab:pid" + states[i], std::to_string(i + 1) + ".0");
  for (const auto& [name, command] : outputs)
    EXPECT_EQ(Ioc::put("lab:pid" + name, std::to_string(command) + ".5"), 0);
  for (const auto& [name, command] : outputs) EXPECT_EQ(valueOf(command), command + 0.5) << name;

  EXPECT_EQ(Ioc::put("lab:pidFeedback", "On"), 0);
  static_cast<void>(valueOf(ip330server::cmdStartFeedback));
  EXPECT_EQ(Ioc::put("lab:pidFeedback", "Off"), 0);
  static_cast<void>(valueOf(ip330server::cmdStopFeedback));
}

// The server replies with its command and the text that it was sent.
TEST_F(DatabasesTest, SerialWritesAndReadsAsItsModeSays) {
  std::atomic<std::size_t> written = 0;
  const ThreadServer server(backplane_, "line", [&](MessageServer& self, Message&& message) {
    auto request = *Char8ArrayMessage::tryFrom(std::move(message));
    const auto command = request->cmd & serial::cmdCommandMask;
    const std::string bytes(request.value().begin(), request.value().end());
    if (command == serial::cmdWrite) written = bytes.size();
    const auto answer = fmt::format("{}:{}\r\n", command, bytes);
    auto reply = self.allocReplyMessage<Char8Array>(request, answer.size());
    std::ranges::copy(answer, reply.value().begin());
    static_cast<void>(self.reply(std::move(reply)));
  });
  const Ioc ioc(databaseText("serial.db"), "P=lab:,R=dmm,SERVER=line");

  EXPECT_EQ(Ioc::put("lab:dmmOut", "*IDN?"), 0);
  Ioc::waitFor("lab:dmmWriteRead", "3:*IDN?");

  EXPECT_EQ(Ioc::put("lab:dmmMode", "Write"), 0);
  EXPECT_EQ(Ioc::put("lab:dmmOut", "*RST\\r"), 0);
  while (written == 0) std::this_thread::yield();
  EXPECT_EQ(written, 5U) << "the escape is one byte";

  EXPECT_EQ(Ioc::put("lab:dmmMode", "Read"), 0);
  EXPECT_EQ(Ioc::put("lab:dmmOut", ""), 0);
  Ioc::waitFor("lab:dmmRead", "1:");
}

}  // namespace
}  // namespace mpf::test
