// SPDX-License-Identifier: MIT
// DigitalIoRecordTest: the digital I/O server with the model of an IP-Unidig-I, whose 24 lines are
// inputs and outputs, for records of DTYP "MPF".
//
//   record ── DevMpf ── backplane ── c-UnidigIn, c-UnidigOut ── driver ── model
#pragma once

#include <optional>

#include <mpf/digital_io_commands.h>

#include "drivers/digital_io/digital_io_model.h"
#include "server/programs/digital_io_server/input_server.h"
#include "server/programs/digital_io_server/output_server.h"
#include "tests/epics/epics_fixture.h"
#include "tests/support/model_carrier.h"

namespace mpf::test {

class DigitalIoRecordTest : public EpicsTest {
 protected:
  static constexpr std::uint32_t kAll = 0xffffff;

  DigitalIoRecordTest() {
    plug();
    io_.emplace(
        modules_.create("dio", "ipac", "IP_a", digitalIoModules()),
        DigitalIoOptions{
            .pollEvery = std::chrono::hours(1), .vector = 116, .rising = kAll, .falling = kAll});
  }
  ~DigitalIoRecordTest() override { stopServers(); }

  void plug() {
    auto model = std::make_unique<DigitalIoModel>(*findDigitalIoKind("IP-Unidig-I"));
    model_ = &carrier_.plug("IP_a", std::move(model));
  }
  void startServers() {
    inputs_.emplace(backplane_, "c-UnidigIn", ServerOptions(), *io_, log_, [] {});
    server_.emplace(backplane_, "c-UnidigOut");
    outputs_.emplace(*server_, *io_, log_);
    thread_ = std::thread([this] { server_->run(); });
  }
  void stopServers() {
    if (server_) server_->interrupt();
    if (thread_.joinable()) thread_.join();
    outputs_.reset();
    server_.reset();
    inputs_.reset();
  }
  // Processes a record and waits until its request has a reply.
  static void process(const std::string& record) {
    static_cast<void>(Ioc::put(record + ".PROC", "1"));  // fails without the server
    Ioc::waitFor(record + ".PACT", "0");
  }
  // Waits until the record has processed with a connection to its server.
  static void waitForServer(const std::string& record) {
    while (Ioc::get(record + ".STAT") == "UDF" || Ioc::get(record + ".STAT") == "COMM")
      process(record);
  }

  IndustryPackCarriers carriers_;
  ModelCarrier& carrier_ = addModelCarrier(carriers_);
  IndustryPackModules modules_{carriers_};
  DigitalIoModel* model_ = nullptr;
  std::optional<DigitalIo> io_;
  ServerLog log_{"test", "off"};
  std::optional<DigitalInputServer> inputs_;
  std::optional<MessageServer> server_;  // of the outputs
  std::optional<DigitalOutputServer> outputs_;
  std::thread thread_;
};

}  // namespace mpf::test
