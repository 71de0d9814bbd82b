// SPDX-License-Identifier: MIT
// waveform_server: sends each subscriber a sine wave ten times a second, until SIGTERM or SIGINT.
#include <chrono>
#include <cmath>
#include <csignal>
#include <vector>

#include <mpf/message_server.h>

namespace {

constexpr std::size_t kSamples = 1000;

mpf::MessageServer* running = nullptr;
volatile std::sig_atomic_t stopped = 0;

void stop(int /*signal*/) {
  stopped = 1;
  running->interrupt();
}

// Returns false when the subscriber is gone. A full queue costs the subscriber this waveform only.
bool sendWaveform(mpf::MessageServer& server, const mpf::Message& request, double phase) {
  // in the memory that the client reads
  auto reply = server.allocReplyMessage<mpf::Float64Array>(request, kSamples);
  double x = phase;
  for (auto& sample : reply.value()) sample = std::sin(x += 0.01);
  return server.reply(std::move(reply)) != mpf::ReplyResult::clientGone;
}

}  // namespace

int main() {
  using namespace std::chrono_literals;
  mpf::MessageServer server(mpf::Backplane::attach(), "waveform");
  // a request that the server keeps may be answered any number of times
  std::vector<mpf::Message> subscribers;
  server.on<mpf::Int32>(
      [&](mpf::Int32Message&& request) { subscribers.push_back(std::move(request)); });
  running = &server;
  std::signal(SIGTERM, stop);
  std::signal(SIGINT, stop);

  double phase = 0;
  while (stopped == 0) {
    const auto next = mpf::Deadline::after(100ms);
    while (server.waitForMessage(next)) {
      while (server.handleOne()) {
      }
    }
    std::erase_if(subscribers,
                  [&](const auto& request) { return !sendWaveform(server, request, phase); });
    phase += 0.1;
  }
}
