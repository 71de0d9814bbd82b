// SPDX-License-Identifier: MIT
// ToolsTest: `mpf` on a backplane of its own, with an echo server that a thread of the test runs.
// At its end, no segment may be left.
#pragma once

#include <chrono>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <thread>
#include <tuple>

#include <mpf/message_server.h>
#include <mpf/sync_client.h>

#include "shm/segment.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"
#include "tests/tools/tool.h"

namespace mpf::test {

using namespace std::chrono_literals;

// Sends back every message of every type.
class EchoThread {
 public:
  EchoThread(const Backplane& backplane, const std::string& name, const ServerOptions& options = {})
      : server_(backplane, name, options) {
    echo(std::type_identity<MessageTypes>{});
    thread_ = std::thread([this] { server_.run(); });
  }
  ~EchoThread() {
    server_.interrupt();
    thread_.join();
  }
  EchoThread(const EchoThread&) = delete;
  EchoThread& operator=(const EchoThread&) = delete;

 private:
  template <class T>
  void echo(std::type_identity<T> /*type*/) {
    if constexpr (!detail::kIsNotification<T>) server_.on<T>([](MessageOf<T>&) {});
  }
  template <class... T>
  void echo(std::type_identity<std::tuple<T...>> /*types*/) {
    (echo(std::type_identity<T>()), ...);
  }
  MessageServer server_;
  std::thread thread_;
};

class ToolsTest : public testing::Test {
 protected:
  void TearDown() override {
    EXPECT_THAT(backplane_.segmentNames(), testing::IsEmpty()) << "left behind";
  }

  Ended run(std::vector<std::string> arguments) const {
    return runTool(std::move(arguments), backplane_.name());
  }
  // Runs a subcommand with --json and returns its output.
  nlohmann::json report(std::vector<std::string> arguments) const {
    arguments.emplace_back("--json");
    const auto ended = run(std::move(arguments));
    EXPECT_EQ(ended.status, 0) << ended.err;
    return nlohmann::json::parse(ended.out);
  }
  [[nodiscard]] nlohmann::json ls() const { return report({"ls"}).at(0); }

  // The files of the backplane: for each name its inode, times, size and bytes.
  [[nodiscard]] std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> all;
    for (const auto& name : backplane_.segmentNames()) {
      struct stat status{};
      checkCall(::lstat(segments::path(name).c_str(), &status), "lstat", name);
      std::ostringstream text;
      text << status.st_ino << ' ' << status.st_mode << ' ' << status.st_nlink << ' '
           << status.st_size << ' ' << status.st_mtim.tv_sec << '.' << status.st_mtim.tv_nsec << ' '
           << status.st_ctim.tv_sec << '.' << status.st_ctim.tv_nsec << '\n';
      if (S_ISREG(status.st_mode))
        text << std::ifstream(segments::path(name), std::ios::binary).rdbuf();
      all[name] = text.str();
    }
    return all;
  }

  Watchdog watchdog_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  TestBackplane backplane_;
};

inline std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// A text without its line breaks and indents, to find words that may be on two lines.
inline std::string inOneLine(const std::string& text) {
  std::string line;
  std::istringstream words(text);
  for (std::string word; words >> word;) line += (line.empty() ? "" : " ") + word;
  return line;
}

// The entry of `list` whose `key` is `value`; null without such an entry.
inline nlohmann::json entryOf(const nlohmann::json& list, const std::string& key,
                              const nlohmann::json& value) {
  for (const auto& entry : list) {
    if (entry.contains(key) && entry.at(key) == value) return entry;
  }
  return nullptr;
}

}  // namespace mpf::test
