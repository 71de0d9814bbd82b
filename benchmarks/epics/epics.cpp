// SPDX-License-Identifier: MIT
#include "benchmarks/epics/epics.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fmt/format.h>
#include <iterator>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/command_line.h"
#include "base/system_call.h"
#include "benchmarks/epics/bench_ioc.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

std::vector<Measurement> allEpicsRows(const EpicsBench& bench) {
  auto all = floorMeasurements();
  std::erase_if(all, [](const Measurement& row) { return row.name != kFutexBounce; });
  for (auto more :
       {recordRequestRows(bench), scannedRows(bench), subscriptionRows(bench), faultRows(bench)})
    std::move(more.begin(), more.end(), std::back_inserter(all));
  for (auto& row : all) row.skipped = whyNoBenchIoc();
  return all;
}

// Keeps Channel Access of the processes of all rows on loopback, at a port that was free.
void keepOnLoopback() {
  const FileDescriptor socket(
      checkCall(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket", "UDP"));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  checkCall(::bind(socket.get(), reinterpret_cast<sockaddr*>(&address), length), "bind");
  checkCall(::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &length),
            "getsockname");
  const auto port = std::to_string(ntohs(address.sin_port));
  for (const auto& [name, value] :
       {std::pair<const char*, std::string>{"EPICS_CA_SERVER_PORT", port},
        {"EPICS_CAS_INTF_ADDR_LIST", "127.0.0.1"},
        {"EPICS_CAS_BEACON_ADDR_LIST", "127.0.0.1"},
        {"EPICS_CAS_AUTO_BEACON_ADDR_LIST", "NO"},
        {"EPICS_CA_ADDR_LIST", "127.0.0.1"},
        {"EPICS_CA_AUTO_ADDR_LIST", "NO"},
        {"PVXS_QSRV_ENABLE", "NO"}})
    ::setenv(name, value.c_str(), 1);
}

}  // namespace

void addOptions(CLI::App& app, EpicsOptions& options) {
  addOptions(app, static_cast<Options&>(options));
  addWaitOption(app, options.wait);
  app.add_option("--kills", options.kills,
                 "Number of kills in the rows about servers that are killed; default 500")
      ->check(wholeNumber(1, 1'000'000));
}

int runEpics(const EpicsOptions& options) {
  const auto placement = place(options, true);
  if (!placement) return 2;
  keepOnLoopback();
  const Pace pace{std::chrono::seconds(2), std::chrono::seconds(6),
                  [&](const Measurement& row) { return options.quick || row.isSlow ? 1 : 3; }};
  return run(allEpicsRows({kRunPrefix + std::to_string(::getpid()), options.wait, options.kills}),
             placement, options, pace, [&](const auto& results) {
               return fmt::format(
                          "CPU {}: server. CPU {}: IOC and bare client. The server waits in "
                          "mode {}.\n",
                          toString(placement->server), toString(placement->requester),
                          toString(options.wait)) +
                      epicsTable(results) + epicsGoals(results);
             });
}

}  // namespace mpf::bench
