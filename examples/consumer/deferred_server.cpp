// SPDX-License-Identifier: MIT
// deferred_server: a thread of its own replies to the requests, one after the other, while the
// server takes further ones, until SIGTERM or SIGINT.
//
//   Int32 value ──► its square root; a negative value is refused
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <exception>
#include <iostream>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <thread>

#include <mpf/message_server.h>

namespace {

// Owns the requests that wait. Those that remain when it is destroyed are refused.
class Worker {
 public:
  explicit Worker(mpf::MessageServer& server) : server_(server) {}
  void add(mpf::Int32Message&& request) {
    const std::lock_guard lock(mutex_);
    waiting_.push_back(std::move(request));
    changed_.notify_one();
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) {
      auto request = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      finish(std::move(request));
      lock.lock();
    }
  }
  void finish(mpf::Int32Message&& request) {
    if (!server_.isClientConnected(request)) return;  // nobody waits for the work
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // a slow device
    request->value = static_cast<std::int32_t>(std::sqrt(request->value));
    server_.reply(std::move(request));  // `sent` also if the client has cancelled the request
  }

  mpf::MessageServer& server_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<mpf::Int32Message> waiting_;
  std::jthread thread_{[this](const std::stop_token& stop) { run(stop); }};
};

}  // namespace

int main() {
  mpf::MessageServer server(mpf::Backplane::attach(), "worker");
  Worker worker(server);
  server.on<mpf::Int32>([&](mpf::Int32Message&& request) {
    if (request->value < 0) throw std::out_of_range("a negative value");
    worker.add(std::move(request));
  });
  for (;;) {
    try {
      return server.runUntilSignal();
    } catch (const std::exception& error) {  // of a handler; its request has been refused
      std::cerr << "deferred_server: " << error.what() << '\n';
    }
  }
}
