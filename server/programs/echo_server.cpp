// SPDX-License-Identifier: MIT
#include "server/programs/echo_server.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fmt/format.h>

#include "base/command_line.h"
#include "base/run_main.h"
#include "server/programs/server_arguments.h"
#include "server/programs/server_log.h"
#include "shm/link.h"

namespace mpf {

namespace {

int serve(int argc, char** argv, const EchoServer& echo) {
  CLI::App app(
      fmt::format("{} - replies to each {} with the same message", echo.program, echo.what),
      echo.program);
  std::string name = echo.server;
  ServerArguments arguments;
  app.add_option("server", name, "Name under which clients find it")->capture_default_str();
  app.add_option(
         "--queue-size", arguments.messages.queueSize,
         fmt::format("Requests of one client that may wait, 1 to {}", LinkGeometry::kMaxQueueSize))
      ->capture_default_str()
      ->check(wholeNumber(1, LinkGeometry::kMaxQueueSize));
  arguments.addTo(app);
  if (const auto status = parseCommandLine(app, argc, argv)) return *status;
  if (arguments.checkOnly) return 0;

  const ServerLog log(echo.program, arguments.logLevel);
  MessageServer server(Backplane::attach(arguments.backplane), name, arguments.messages);
  logShortages(server, *log);
  echo.answer(server);
  log->info(R"(serving "{}" at location {})", name, server.location());
  const auto status = server.runUntilSignal();
  log->info("stopped");
  return status;
}

}  // namespace

int runEchoServer(int argc, char** argv, const EchoServer& echo) {
  return runMain(echo.program, [&] { return serve(argc, argv, echo); });
}

}  // namespace mpf
