// SPDX-License-Identifier: MIT
// camera_server: publishes an image of 4 MB to all subscribers ten times a second, without a copy
// for each of them, until SIGTERM or SIGINT.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <vector>

#include <mpf/message_server.h>

namespace {

constexpr std::size_t kPixels = 1024 * 1024;

mpf::MessageServer* running = nullptr;
volatile std::sig_atomic_t stopped = 0;

void stop(int /*signal*/) {
  stopped = 1;
  running->interrupt();
}

}  // namespace

int main() {
  using namespace std::chrono_literals;
  // A subscriber that holds two images gets no more until it has destroyed one.
  mpf::MessageServer server(mpf::Backplane::attach(), "camera", {.maxBorrowed = 2});
  std::vector<mpf::Message> subscribers;
  server.on<mpf::Int32>(
      [&](mpf::Int32Message&& request) { subscribers.push_back(std::move(request)); });
  running = &server;
  std::signal(SIGTERM, stop);
  std::signal(SIGINT, stop);

  for (std::int32_t number = 1; stopped == 0; ++number) {
    const auto next = mpf::Deadline::after(100ms);
    while (server.waitForMessage(next)) {
      while (server.handleOne()) {
      }
    }
    // in the memory that all clients read
    auto image = server.allocShared<mpf::Int32Array>(kPixels);
    image->extra = number;
    std::ranges::fill(image.value(), number);
    server.publish(image, subscribers);
    std::erase_if(subscribers,
                  [&](const auto& request) { return !server.isClientConnected(request); });
  }
}
