// SPDX-License-Identifier: MIT
// The program behind Victim: an echo server, or a client that sends as fast as it can.
#include <signal.h>
#include <sys/prctl.h>

#include <cstdio>
#include <string>

#include <mpf/client/message_client.h>
#include <mpf/server/message_server.h>

namespace {

using namespace std::chrono_literals;

// Echoes; keeps each seventh Int32 (and so drops the one kept before), and answers some arrays with new ones.
int serve(const mpf::Backplane& backplane, mpf::WaitMode mode) {
  mpf::MessageServer server(backplane, "echo", {.queueSize = 32, .waitMode = mode});
  mpf::Message kept;
  int requests = 0;
  server.on<mpf::Int32>([&](mpf::Int32Message&& request) {
    if (++requests % 7 == 0) {
      kept = std::move(request);
    } else {
      static_cast<void>(server.reply(std::move(request)));
    }
  });
  server.on<mpf::Float64Array>([&](mpf::Float64ArrayMessage&& request) {
    if (++requests % 3 != 0) return static_cast<void>(server.reply(std::move(request)));
    auto reply = server.allocReplyMessage<mpf::Float64Array>(request, 3000);
    static_cast<void>(server.reply(std::move(reply)));
  });
  server.on<mpf::Float64>([](mpf::Float64& request) { request.value += 1; });
  return server.runUntilSignal();
}

int flood(const mpf::Backplane& backplane) {
  mpf::MessageClient client(backplane, [](const mpf::Message&) {});
  client.bind("echo");
  if (!client.connectWait(60s)) return 1;
  for (int sent = 0;; ++sent) {
    if (sent % 3 != 0) {
      static_cast<void>(client.send(mpf::Int32Message({.value = sent})));
    } else {
      static_cast<void>(client.send(client.alloc<mpf::Float64Array>(1000)));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const std::string role = argc > 1 ? argv[1] : "";
  const auto backplane = mpf::Backplane::attach(argc > 2 ? argv[2] : "");
  if (role == "serve") return serve(backplane, mpf::WaitMode::adaptive);
  if (role == "serve-block") return serve(backplane, mpf::WaitMode::block);
  if (role == "flood") return flood(backplane);
  std::fprintf(stderr, "role \"%s\": use serve, serve-block or flood\n", role.c_str());
  return 2;
}
