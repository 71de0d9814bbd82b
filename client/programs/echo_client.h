// SPDX-License-Identifier: MIT
// Echo clients: send numbered messages to an echo server and check what comes back (manual:
// clientInt32, clientChar8Array).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include <mpf/message.h>

namespace mpf {

struct EchoClient {
  std::string program;
  std::string server;
  std::string what;
  std::function<Message(int i, std::size_t bytes)> make;  // message number i
  // whether a reply is its echo
  std::function<bool(int i, std::size_t bytes, const Message& reply)> isEcho;
};

// Parses the command line, calls the server and reports. Returns the exit status: 0 when every
// message came back.
int runEchoClient(int argc, char** argv, const EchoClient& echo);

}  // namespace mpf
