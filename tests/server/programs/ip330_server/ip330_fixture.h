// SPDX-License-Identifier: MIT
// Ip330ServersTest: all servers over a model of the board in real time, and a DAC128V's model whose
// channel 2 is on input 1.
#pragma once

#include <atomic>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <vector>

#include <mpf/ip330_commands.h>

#include "drivers/dac128v/dac128v_model.h"
#include "drivers/ip330/ip330_model.h"
#include "server/programs/ip330_server/ip330_servers.h"
#include "tests/server/programs/hardware/hardware_fixture.h"

namespace mpf::test {

class Ip330ServersTest : public HardwareTest {
 protected:
  Ip330ServersTest() {
    servers_.addScan("scan", 20, 0, 3, 0ms);
    servers_.addConfig("config", 20);
    servers_.addSweep("sweep", 20, 0, 3, 100);
    servers_.addPid("pid", 20, 1, dac_, 2);
  }

  // The signals are there before the first scan.
  Ip330Model& plugAdc() {
    auto& adc = carrier_.plug("IP_a", std::make_unique<Ip330Model>(Ip330ModelOptions{
                                          .gainError = {-0.01}, .offsetError = {50}}));
    adc.setSignal(0, dcSignal(2.5));
    adc.setSignal(1, [this](double) { return volts_.load(); });
    return adc;
  }
  static Answer call(SyncClient& client, Message&& message) {
    auto answer = client.call(std::move(message), 60s);
    EXPECT_TRUE(answer) << answer.why();
    return answer;
  }
  Int32 ask(const std::string& server, const Int32& fields) {
    SyncClient client(backplane_, server);
    auto reply = call(client, Int32Message(fields)).as<Int32>();
    return reply ? **reply : Int32{.status = -99};
  }
  std::int32_t tell(const std::string& server, std::int32_t command, double value = 0) {
    SyncClient client(backplane_, server);
    auto reply = call(client, Float64Message({.cmd = command, .value = value})).as<Float64>();
    return reply ? (*reply)->status : -99;
  }
  template <class Array>
  struct Values {
    std::int32_t status = -99;
    std::vector<typename Array::Element> values;
  };
  template <class Array>
  Values<Array> askArray(const std::string& server, std::int32_t command,
                         std::int32_t address = 0) {
    SyncClient client(backplane_, server);
    auto reply = call(client, Float64Message({.cmd = command, .address = address})).as<Array>();
    if (!reply) return {};
    return {(*reply)->status, {reply->value().begin(), reply->value().end()}};
  }
  void waitForScans(std::uint64_t scans) {
    const auto before = servers_.board().counters().scans;
    while (servers_.board().counters().scans < before + scans) std::this_thread::yield();
  }

  std::atomic<double> volts_{0};
  Ip330Model& adc_ = plugAdc();
  Dac128vModel& dacModel_ = carrier_.plug(
      "IP_b", std::make_unique<Dac128vModel>(Dac128vRanges{}, [this](int channel, double volts) {
        if (channel == 2) volts_ = volts / 4 + 0.1;
      }));
  IndustryPackModule adcModule_{"adc", "a model", carrier_.site(0), kIp330};
  IndustryPackModule dacModule_{"dac", "a model", carrier_.site(1), Dac128v::kind()};
  Dac128v dac_{dacModule_};
  // A delayed test must not be mistaken for a board that does not respond.
  Ip330Servers servers_{
      backplane_,
      {},
      adcModule_,
      {.lastChannel = 3},
      log_,
      {.conversion = 20ms, .silence = 1h, .lookEvery = 1ms, .pollEvery = 1ms, .stormPause = 5ms}};
};

}  // namespace mpf::test
