// SPDX-License-Identifier: MIT
// DigitalIoServerTest: both servers of a model of a digital I/O module, and a client of each.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "drivers/digital_io/digital_io_model.h"
#include "server/programs/digital_io_server/input_server.h"
#include "server/programs/digital_io_server/output_server.h"
#include "tests/server/programs/hardware/hardware_fixture.h"

namespace mpf::test {

class DigitalIoServerTest : public HardwareTest {
 protected:
  static constexpr auto kNever = std::chrono::hours(1);  // polls
  static constexpr std::int32_t kAll = 0xffffff;

  void start(const DigitalIoOptions& options = {.pollEvery = kNever,
                                                .vector = 116,
                                                .rising = kAll,
                                                .falling = kAll},
             const std::string& kind = "IP-Unidig-I") {
    plug(kind);
    io_.emplace(modules_.create("dio", "ipac", "IP_a", digitalIoModules()), options);
    inputs_.emplace(backplane_, "dioIn", ServerOptions(), *io_, log_, [this] {
      hasFailed_ = true;
      server_.interrupt();
    });
    outputs_.emplace(server_, *io_, log_);
    thread_ = std::thread([this] { server_.run(); });
  }
  DigitalIoModel& plug(const std::string& kind = "IP-Unidig-I") {
    model_ = &carrier_.plug("IP_a", std::make_unique<DigitalIoModel>(*findDigitalIoKind(kind)));
    return *model_;
  }
  void TearDown() override {
    server_.interrupt();
    if (thread_.joinable()) thread_.join();
  }
  void waitForMonitors(std::size_t count) {
    while (inputs_->monitors() != count) std::this_thread::yield();
  }

  MessageServer server_{backplane_, "dioOut"};
  DigitalIoModel* model_ = nullptr;
  std::atomic<bool> hasFailed_{false};
  std::optional<DigitalIo> io_;
  std::optional<DigitalInputServer> inputs_;
  std::optional<DigitalOutputServer> outputs_;
  std::thread thread_;
  HardwareAsker in_{backplane_, "dioIn"};
  HardwareAsker out_{backplane_, "dioOut"};
};

}  // namespace mpf::test
