// SPDX-License-Identifier: MIT
// mpf-router: joins this host's backplane to those of others.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "base/run_main.h"
#include "base/service_manager.h"
#include "base/standard_descriptors.h"
#include "router/arguments.h"
#include "router/kj_log.h"
#include "router/router.h"
#include "router/transport/kj_text.h"
#include "server/programs/server_log.h"

namespace {

using mpf::ServiceManager;
using mpf::router::Router;
using mpf::router::RouterArguments;

constexpr auto kStopTimeout = 2 * kj::SECONDS;  // for sending farewells
constexpr unsigned kTurnsBetweenPolls = 32;     // polls of descriptors, timers and signals

// Writes each listening address on a line of its own, for a parent process that uses port 0 or
// waits until the router listens.
void writeAddresses(int fd, Router& router) {
  if (fd < 0) return;
  std::string text;
  for (const auto& address : router.listening()) text += address.text() + '\n';
  for (std::size_t at = 0; at < text.size();) {
    const auto written = ::write(fd, text.data() + at, text.size() - at);
    if (written <= 0) break;
    at += static_cast<std::size_t>(written);
  }
  mpf::closeDescriptor(fd);
}

// An error in the configuration is logged and changes nothing.
void reload(Router& router, const RouterArguments& arguments, const mpf::ServerLog& log) {
  ServiceManager::notifyReloading();
  try {
    router.reload(arguments.loadConfig());
    log->info("the configuration has been reloaded");
  } catch (const std::exception& error) {
    log->error("cannot reload the configuration, the old one stays in effect: {}", error.what());
  }
  ServiceManager::notifyReady();
}

kj::Promise<void> reloadAtHangup(kj::UnixEventPort& port, Router& router,
                                 const RouterArguments& arguments, const mpf::ServerLog& log) {
  return port.onSignal(SIGHUP).then([&](siginfo_t&&) {
    reload(router, arguments, log);
    return reloadAtHangup(port, router, arguments, log);
  });
}

// Never resolves.
kj::Promise<void> serve(kj::UnixEventPort& port, Router& router, const RouterArguments& arguments,
                        const mpf::ServerLog& log) {
  return router.start().then([&] {
    for (const auto& address : router.listening()) log->info("listening on {}", address.text());
    writeAddresses(arguments.readyDescriptor(), router);
    ServiceManager::notifyReady();
    return reloadAtHangup(port, router, arguments, log);
  });
}

MPF_KEEPS_KJ_LOG int run(const RouterArguments& arguments) {
  // Before the first thread starts.
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) kj::UnixEventPort::captureSignal(signal);
  const mpf::ServerLog log("mpf-router", arguments.config().logLevel);
  const mpf::router::KjLog kjLog(*log);
  auto io = kj::setupAsyncIo();
  // Otherwise a peer that sends faster than the router reads would keep the event loop from
  // polling.
  io.waitScope.setBusyPollInterval(kTurnsBetweenPolls);
  auto& port = io.unixEventPort;
  Router router(io, arguments.config(), *log);
  auto stopSignal = port.onSignal(SIGTERM).exclusiveJoin(port.onSignal(SIGINT)).ignoreResult();
  // SIGTERM and SIGINT also end the start-up. After this wait, SIGHUP is ignored.
  serve(port, router, arguments, log).exclusiveJoin(kj::mv(stopSignal)).wait(io.waitScope);
  ServiceManager::notifyStopping();
  log->info("stopping");
  router.stop().exclusiveJoin(io.provider->getTimer().afterDelay(kStopTimeout)).wait(io.waitScope);
  return 0;
}

int route(int argc, char** argv) try {
  RouterArguments arguments;
  if (const auto status = arguments.start(argc, argv)) return *status;
  return run(arguments);
} catch (const kj::Exception& error) {  // its what() contains source locations and a stack trace
  throw std::runtime_error(mpf::router::toStd(error.getDescription()));
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf-router", [&] { return route(argc, argv); });
}
