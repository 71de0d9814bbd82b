// SPDX-License-Identifier: MIT
#include "benchmarks/epics/record_server.h"

#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {

MessageServer makeRecordServer(const EpicsBench& bench) {
  constexpr int kRequestsOfAllRecords = 10'000;
  auto options = serverOptions(bench.wait);
  options.queueSize = kRequestsOfAllRecords;
  return {Backplane::attach(bench.backplane), kServer, options};
}

void echoRequests(const RunContext& context, const EpicsBench& bench) {
  auto server = makeRecordServer(bench);
  context.ready();
  for (std::uint64_t count = 0; server.waitForMessage();) {
    while (auto request = server.receive()) {
      static_cast<void>(server.reply(std::move(request)));
      context.consumed(++count);
    }
  }
}

}  // namespace mpf::bench
