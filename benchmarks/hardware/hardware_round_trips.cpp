// SPDX-License-Identifier: MIT
// The rows of `mpf bench hardware` about round trips of one client, beside the echo server.
#include <stdexcept>

#include <mpf/digital_io_commands.h>
#include <mpf/message_client.h>

#include "benchmarks/hardware/hardware.h"
#include "benchmarks/hardware/serial_ends.h"
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

constexpr std::size_t kInt32Bytes = 4;
constexpr std::int32_t kMeanMs = 10;  // of the 1 kHz at which a model scans

// Sends the same request to one server repeatedly.
class Asker {
 public:
  Asker(const Bench& bench, const std::string& server, const Int32& request)
      : request_(request),
        dispatcher_(Backplane::attach(bench.backplane), {waitMode(bench.wait), {}}),
        client_(dispatcher_, [this](Message&& message) { take(message); }) {
    client_.bind(server, 0);
    if (!client_.connectWait(kConnectLimit))
      throw std::runtime_error("not connected: " + client_.notConnectedBecause());
  }
  void roundTrip() {
    const auto wanted = received_ + 1;
    if (client_.send(Int32Message(request_)) != SendResult::sent)
      throw std::runtime_error("a request could not be sent");
    while (received_ < wanted) dispatcher_.runOnce();
  }

 private:
  void take(const Message& message) {
    if (message.getType() == MessageType::connect) return;
    const auto* const reply = message.tryAs<Int32>();
    if (reply == nullptr || reply->status != 0)
      throw std::runtime_error("the reply is not an Int32 message with status 0");
    ++received_;
  }

  const Int32 request_;
  Dispatcher dispatcher_;
  MessageClient client_;
  std::uint64_t received_ = 0;
};

Outcome askAgainAndAgain(const Stage& stage, HardwareServers& servers, const std::string& server,
                         const Int32& request) {
  Workload workload;
  workload.requester = [&](const RunContext& context) {
    Asker asker(servers.bench(), server, request);
    Meter meter(stage.placement(), Meter::kNobody);
    timeExchanges(context, meter, 1, [&] { asker.roundTrip(); });
  };
  return servers.run([&] { return stage.run(workload); });
}

// Measures one port, with one request at a time.
Outcome askPort(const Stage& stage, HardwareServers& servers, bool awaitsEcho) {
  Workload workload;
  workload.server = playInstruments(stage, servers, awaitsEcho);
  workload.requester = [&](const RunContext& context) {
    std::uint64_t received = 0;
    PortClients clients(servers.bench(), 1, kInt32Bytes, awaitsEcho,
                        [&](std::size_t, bool isWhole) {
                          if (!isWhole) throw std::runtime_error("characters were lost");
                          ++received;
                        });
    Meter meter(stage.placement(), Meter::kNobody);
    timeExchanges(context, meter, 1, [&] {
      const auto wanted = received + 1;
      clients.send(0);
      while (received < wanted) clients.runOnce();
    });
  };
  return servers.run([&] { return stage.run(workload); });
}

Measurement besideEcho(Measurement row) {
  row.bytes = kInt32Bytes;
  row.floorName = kEcho;
  row.floorBytes = kInt32Bytes;
  return row;
}

Measurement asking(const std::shared_ptr<HardwareServers>& servers, const std::string& program,
                   const std::string& what, const std::string& server, const Int32& request) {
  auto row = besideEcho(rowOf(servers, program, kServers, program + ", " + what));
  row.run = [=](const Stage& stage) { return askAgainAndAgain(stage, *servers, server, request); };
  return row;
}

Measurement askingPort(const std::shared_ptr<HardwareServers>& servers, const std::string& what,
                       bool awaitsEcho) {
  auto row =
      besideEcho(rowOf(servers, "mpf-serial-server", kServers, "mpf-serial-server, " + what));
  row.run = [=](const Stage& stage) { return askPort(stage, *servers, awaitsEcho); };
  return row;
}

Measurement echoRow(const Bench& bench) {
  const auto servers = std::make_shared<HardwareServers>(bench, std::vector<std::string>{});
  auto row = rowOf(servers, "echo", kServers, kEcho);
  row.bytes = kInt32Bytes;
  row.run = [=](const Stage& stage) { return askAgainAndAgain(stage, *servers, "echo", {}); };
  return row;
}

}  // namespace

std::vector<Measurement> roundTripRows(const Bench& bench) {
  const auto over = [&](std::vector<std::string> words) {
    return std::make_shared<HardwareServers>(bench, std::move(words));
  };
  const std::string dac = "mpf-dac128v-server", adc = "mpf-ip330-server",
                    dio = "mpf-digital-io-server";
  const auto onDac = over({dac, "dac", "ipac", "IP_a", "--carrier", "ipac=model"});
  const auto onAdc =
      over({adc, "adc", "ipac", "IP_a", "S", "-5to5", "0", "31", "--carrier", "ipac=model"});
  const auto onDio = over({dio, "dio", "ipac", "IP_a", "--carrier", "ipac=model"});
  const auto onUart = over(eightPorts(false));
  return {
      echoRow(bench),
      asking(onDac, dac, "an output set", "dac", {.address = 3}),
      asking(onAdc, adc, "a mean of 10 scans", "adc", {.address = 5, .extra = kMeanMs}),
      asking(onDio, dio, "outputs set", "dioOut", {.cmd = digital::cmdWriteBits, .address = 1}),
      asking(onDio, dio, "inputs read", "dioIn", {.cmd = digital::cmdReadBits, .address = 0xff}),
      askingPort(onUart, "4 characters written", false),
      askingPort(onUart, "4 characters and their echo", true)};
}

}  // namespace mpf::bench
