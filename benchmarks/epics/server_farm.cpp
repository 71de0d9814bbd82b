// SPDX-License-Identifier: MIT
#include "benchmarks/epics/server_farm.h"

#include <signal.h>
#include <sys/wait.h>

#include <mpf/message_server.h>

#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {

void ServerFarm::keep(const RunContext& context, const EpicsBench& bench) {
  for (int server = 0; server < kServers; ++server) start(server, bench);
  context.ready();
  for (;;) {
    reap();
    for (int server = 0; server < kServers; ++server)
      if (places_[server].isWanted && places_[server].pid == 0) start(server, bench);
    sleepFor(std::chrono::microseconds(200));
  }
}

void ServerFarm::start(int server, const EpicsBench& bench) {
  auto& place = places_[server];
  place.isWanted = false;
  place.pid = forkProcess([&] {
    MessageServer served(Backplane::attach(bench.backplane), nameOf(server),
                         serverOptions(bench.wait));
    while (served.waitForMessage()) {
      while (auto request = served.receive()) {
        static_cast<void>(served.reply(std::move(request)));
        ++place.answered;
      }
    }
  });
}

void ServerFarm::reap() {
  for (int pid = 0; (pid = ::waitpid(-1, nullptr, WNOHANG)) > 0;) {
    for (int server = 0; server < kServers; ++server)
      if (places_[server].pid == pid) places_[server].pid = 0;
  }
}

void ServerFarm::signal(int server, int number) const {
  if (const int pid = places_[server].pid; pid != 0) ::kill(pid, number);
}

void ServerFarm::restart(int server) { places_[server].isWanted = true; }

}  // namespace mpf::bench
