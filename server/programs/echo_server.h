// SPDX-License-Identifier: MIT
// Echo servers: send back what they get (manual, "Message Server": serverInt32, serverChar8Array).
#pragma once

#include <functional>
#include <string>

#include <mpf/message_server.h>

namespace mpf {

struct EchoServer {
  std::string program;
  std::string server;
  std::string what;
  std::function<void(MessageServer&)> answer;  // adds the handler
};

// Echoes until SIGINT or SIGTERM. Returns the exit status.
int runEchoServer(int argc, char** argv, const EchoServer& echo);

}  // namespace mpf
