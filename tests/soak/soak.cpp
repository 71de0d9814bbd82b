// SPDX-License-Identifier: MIT
// soak DURATION: runs a server, many clients, and clients that flood the server and are killed, for
// this time ("30s", "10m", "2h"). Prints the memory and the files of each process over time; at the
// end they must be the same as after the first quarter. Exit status: 0 no growth; 1 growth or a
// wrong answer.
#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <mpf/sync_client.h>

#include "tests/support/usage.h"
#include "tests/support/victim.h"

namespace mpf::test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kSlackKb = 4096;  // memory that allocators may keep
constexpr int kSamples = 20;

std::chrono::seconds parse(const std::string& text) {
  std::size_t used = 0;
  const auto number = std::stol(text, &used);
  const auto unit = text.substr(used);
  if (unit == "s") return std::chrono::seconds(number);
  if (unit == "m") return std::chrono::minutes(number);
  if (unit == "h") return std::chrono::hours(number);
  throw std::invalid_argument(fmt::format("duration \"{}\": use 30s, 10m or 2h", text));
}

class Soak {
 public:
  explicit Soak(std::chrono::seconds duration) : duration_(duration) {
    static_cast<void>(server_.line());
    // All clients are connected: a later increase is growth.
    while (!crowd_.line().starts_with("answered ")) continue;
    pids_ = {{"server", server_.pid()}, {"crowd", crowd_.pid()}, {"this", ::getpid()}};
  }

  int run() {
    const auto begin = Clock::now();
    for (int sample = 1; sample <= kSamples; ++sample) {
      while (Clock::now() < begin + duration_ * sample / kSamples) visit();
      print(sample);
      if (sample == kSamples / 4) before_ = usage_;
    }
    // The server has noticed the last death.
    for (int i = 0; i < 1000; ++i)
      static_cast<void>(client_->call(Float64Message({.value = 0}), 60s));
    print(kSamples);
    bool flat = true;
    for (const auto& [name, usage] : usage_) {
      if (usage.isWithin(before_.at(name), kSlackKb)) continue;
      fmt::print("{} has grown\n", name);
      flat = false;
    }
    fmt::print("{} right answers, {} clients killed: {}\n", answers_, killed_,
               flat ? "flat" : "NOT flat");
    const bool clean = leavesNothing();
    return flat && clean ? 0 : 1;
  }

 private:
  bool leavesNothing() {
    crowd_.end(SIGKILL);
    server_.end(SIGTERM);
    client_.reset();
    for (const auto& name : backplane_.segmentNames()) fmt::print("left behind: {}\n", name);
    return backplane_.segmentNames().empty();
  }
  // Some requests, which must be answered correctly while a client floods the server and is killed.
  void visit() {
    Victim flood("flood", backplane_.name());
    for (int i = 0; i < 200; ++i) {
      auto answer = client_->call(Float64Message({.value = i + 0.0}), 60s);
      if (!answer) throw std::runtime_error(answer.why());
      if (answer.message().tryAs<Float64>()->value != i + 1.0)
        throw std::runtime_error("a wrong answer");
      ++answers_;
    }
    flood.end(SIGKILL);
    ++killed_;
    static_cast<void>(backplane_.removeDead());
  }
  void print(int sample) {
    for (const auto& [name, pid] : pids_) {
      const auto usage = usage_[name] = Usage::of(pid);
      fmt::print("{:>6} s  {:<8} {:>8} kB {:>5} files {:>5} segments\n",
                 (duration_ * sample / kSamples).count(), name, usage.residentKb, usage.files,
                 usage.segments);
    }
    std::fflush(stdout);
  }

  std::chrono::seconds duration_;
  Backplane backplane_ = Backplane::isolated();
  Victim server_{"serve", backplane_.name()};
  Victim crowd_{"crowd", backplane_.name(), {"50"}};
  std::optional<SyncClient> client_{std::in_place, backplane_, "echo"};
  std::map<std::string, pid_t> pids_;
  std::map<std::string, Usage> usage_;
  std::map<std::string, Usage> before_;
  long answers_ = 0;
  int killed_ = 0;
};

}  // namespace
}  // namespace mpf::test

int main(int argc, char** argv) try {
  return mpf::test::Soak(mpf::test::parse(argc > 1 ? argv[1] : "")).run();
} catch (const std::exception& error) {
  std::fprintf(stderr, "soak: %s\n", error.what());
  return 1;
}
