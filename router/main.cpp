// SPDX-License-Identifier: MIT
// mpf-router: joins this host's backplane to those of others.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <stdexcept>

#include "base/run_main.h"
#include "base/standard_descriptors.h"
#include "router/arguments.h"
#include "router/kj_log.h"
#include "router/router.h"
#include "router/service_manager.h"
#include "router/transport/kj_text.h"
#include "server/programs/server_log.h"

namespace {

using mpf::router::Router;
using mpf::router::RouterArguments;
using mpf::router::ServiceManager;

constexpr auto kToStop = 2 * kj::SECONDS;  // for farewells
constexpr unsigned kTurnsBetweenLooks = 32;  // at descriptors, timers and signals

// Each listening address on a line of its own: for who starts us with port 0 and waits until we
// listen.
void tellAddresses(int fd, Router& router) {
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

// A configuration that is wrong is told, and changes nothing.
void reload(Router& router, const RouterArguments& arguments, const mpf::ServerLog& log) {
  ServiceManager::tellReloading();
  try {
    router.reload(arguments.loadConfig());
    log->info("the configuration has been read again");
  } catch (const std::exception& error) {
    log->error("the configuration stays as it was: {}", error.what());
  }
  ServiceManager::tellReady();
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
    tellAddresses(arguments.readyDescriptor(), router);
    ServiceManager::tellReady();
    return reloadAtHangup(port, router, arguments, log);
  });
}

MPF_KEEPS_KJ_LOG int run(const RouterArguments& arguments) {
  // before there are threads
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) kj::UnixEventPort::captureSignal(signal);
  const mpf::ServerLog log("mpf-router", arguments.config().logLevel);
  const mpf::router::KjLog kjLog(*log);
  auto io = kj::setupAsyncIo();
  // or a peer whose bytes come faster than they are read would be all that there is
  io.waitScope.setBusyPollInterval(kTurnsBetweenLooks);
  auto& port = io.unixEventPort;
  Router router(io, arguments.config(), *log);
  auto toEnd = port.onSignal(SIGTERM).exclusiveJoin(port.onSignal(SIGINT)).ignoreResult();
  // also while it starts; who ends reloads no more
  serve(port, router, arguments, log).exclusiveJoin(kj::mv(toEnd)).wait(io.waitScope);
  ServiceManager::tellStopping();
  log->info("ends");
  router.stop().exclusiveJoin(io.provider->getTimer().afterDelay(kToStop)).wait(io.waitScope);
  return 0;
}

int route(int argc, char** argv) try {
  RouterArguments arguments;
  if (const auto status = arguments.start(argc, argv)) return *status;
  return run(arguments);
} catch (const kj::Exception& error) {  // its what() has places of source files and a stack trace
  throw std::runtime_error(mpf::router::toStd(error.getDescription()));
}

}  // namespace

int main(int argc, char** argv) {
  return mpf::runMain("mpf-router", [&] { return route(argc, argv); });
}
