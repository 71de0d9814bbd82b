// SPDX-License-Identifier: MIT
// Echo clients: send numbered messages to an echo server and check the replies (manual, "Example":
// clientInt32).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include <mpf/message.h>

namespace mpf {

struct EchoClient {
  std::string program;  // name of the program
  std::string server;   // default name of the server
  std::string what;     // what is sent, in the singular: "Int32 message"
  bool isArray;         // whether its size is an option
  std::function<Message(int i, std::size_t bytes)> make;  // message number i
  // Whether `reply` is the echo of message number i.
  std::function<bool(int i, std::size_t bytes, const Message& reply)> isEcho;
};

// Parses the command line, sends the messages and prints a summary. Returns the exit status: 0 when
// the server echoed every message.
int runEchoClient(int argc, char** argv, const EchoClient& echo);

}  // namespace mpf
