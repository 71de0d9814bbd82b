// SPDX-License-Identifier: MIT
// One thread plays both sides of a round trip: the instructions of MPF, without the transfer of
// cache lines between processors.
#include <stdexcept>

#include <mpf/message_client.h>
#include <mpf/message_server.h>

#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

// Connects a client and a server that the same thread runs.
void connect(MessageClient& client, Dispatcher& dispatcher, MessageServer& server) {
  client.bind(kServer);
  const auto limit = Deadline::after(kConnectLimit);
  while (!client.isConnected() && !limit.hasPassed()) {
    static_cast<void>(server.receive());
    static_cast<void>(dispatcher.runOnce(Deadline::atNs(0)));
  }
  if (!client.isConnected())
    throw std::runtime_error("not connected: " + client.notConnectedBecause());
}

Workload bothSides(const std::string& backplane) {
  Workload workload;
  workload.requester = [backplane](const RunContext& context) {
    MessageServer server(Backplane::attach(backplane), kServer, serverOptions(Mode::spin));
    Dispatcher dispatcher(Backplane::attach(backplane), DispatcherOptions{WaitMode::spin, {}});
    std::uint64_t replies = 0;
    MessageClient client(dispatcher, [&](Message&& message) {
      if (message.tryAs<Int32>() != nullptr) ++replies;
    });
    connect(client, dispatcher, server);
    std::uint64_t sent = 0;
    timeEach(context, [&] {
      if (client.send(Int32Message({.address = 3, .value = 100})) != SendResult::sent)
        throw std::runtime_error("a request could not be sent");
      ++sent;
      if (server.reply(server.receive()) != ReplyResult::sent)
        throw std::runtime_error("a reply could not be sent");
      static_cast<void>(dispatcher.runOnce());
      if (replies != sent) throw std::runtime_error("a reply did not arrive");
    });
  };
  return workload;
}

}  // namespace

std::vector<Measurement> oneThreadMeasurements(const std::string& runName) {
  Measurement row;
  row.question = "Round trip of 4 B in one thread: the instructions of both sides";
  row.name = kMpf;
  row.bytes = 4;
  const auto backplane = runName + "-alone";
  row.run = [backplane](const Stage& stage) {
    auto outcome = stage.run(bothSides(backplane));
    removeBackplanes(backplane);
    return outcome;
  };
  return {row};
}

}  // namespace mpf::bench
