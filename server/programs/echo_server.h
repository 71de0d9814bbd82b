// SPDX-License-Identifier: MIT
// Echo servers: reply to each message with the same message (manual, "Example": serverInt32;
// "Serial Support": serverChar8Array).
#pragma once

#include <functional>
#include <string>

#include <mpf/message_server.h>

namespace mpf {

struct EchoServer {
  std::string program;  // name of the program
  std::string server;   // default name of the server
  std::string what;     // name of the message type
  std::function<void(MessageServer&)> answer;  // adds the handler
};

// Serves until SIGINT or SIGTERM. Returns the exit status.
int runEchoServer(int argc, char** argv, const EchoServer& echo);

}  // namespace mpf
