// SPDX-License-Identifier: MIT
// Echo servers: send back what they get (manual, "Message Server": serverInt32, serverChar8Array).
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <fmt/format.h>
#include <string>

#include <mpf/server/message_server.h>

namespace mpf {

struct EchoServer {
  std::string program;
  std::string server;
  std::string what;
};

// Echoes messages of type T until SIGINT or SIGTERM. Returns the exit status.
template <MessageBody T>
int runEchoServer(int argc, char** argv, const EchoServer& echo) try {
  CLI::App app(fmt::format("{} - sends back each {} that it gets", echo.program, echo.what), echo.program);
  std::string name = echo.server;
  std::string backplane;
  ServerOptions options;
  app.add_option("server", name, "Name under which clients find it")->capture_default_str();
  app.add_option("--backplane", backplane, "Backplane; default: $MPF_BACKPLANE, or \"default\"");
  app.add_option("--location", options.location, "Location; default: $MPF_LOCATION, or 0");
  app.add_option("--queue-size", options.queueSize, "Requests of one client that may wait, 1 to 16384")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  MessageServer server(Backplane::attach(backplane), name, options);
  server.on<T>([](MessageOf<T>&) {});
  fmt::print("{}: serving \"{}\" at location {}\n", echo.program, name, server.location());
  std::fflush(stdout);
  return server.runUntilSignal();
} catch (const std::exception& error) {
  fmt::print(stderr, "{}: {}\n", echo.program, error.what());
  return 1;
}

}  // namespace mpf
