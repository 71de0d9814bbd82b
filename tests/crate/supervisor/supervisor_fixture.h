// SPDX-License-Identifier: MIT
// SupervisorTest: a crate with a folder and a backplane of its own, run by `mpf run`.
#pragma once

#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <fmt/format.h>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "crate/supervisor/control_protocol.h"
#include "tests/support/command.h"
#include "tests/support/program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_backplane.h"
#include "tests/support/watchdog.h"

namespace mpf::crate::test {

inline const std::string kServer = "[[server]]\nprogram = \"int32\"\n";

class SupervisorTest : public testing::Test {
 protected:
  SupervisorTest() {
    ::setenv("MPF_CRATES", files_.file("crates").c_str(), 1);
    ::setenv("MPF_BACKPLANE", backplane_.name().c_str(), 1);
  }
  // Ends the crate, also after a test that has failed.
  ~SupervisorTest() override {
    if (supervisor_) stop();
  }

  // Writes the crate file. Its limits are those of a machine with much load, except `limits`.
  void write(const std::string& text, const std::string& limits = {}) {
    std::string supervision = "[supervision]\n" + limits;
    for (const std::string limit : {"start-time = \"15min\"\n", "stop-time = \"15min\"\n",
                                    "stall-limit = \"off\"\n", "first-pause = \"10ms\"\n"}) {
      if (limits.find(limit.substr(0, limit.find(' '))) == std::string::npos) supervision += limit;
    }
    static_cast<void>(files_.write("lab.toml", supervision + text));
  }
  // Starts the crate, and waits until the supervisor answers.
  void run(const std::string& text, const std::string& limits = {}) {
    write(text, limits);
    run();
  }
  void run() { start({MPF, "run", files_.file("lab.toml")}); }
  // The same with a command of the test.
  void start(const std::vector<std::string>& command) {
    supervisor_.emplace(command);
    while (!isAnswering())
      if (supervisor_->hasEnded()) throw std::runtime_error("mpf run: " + supervisor_->errors());
  }
  int stop() {
    const auto status = supervisor_->end(SIGTERM);
    supervisor_.reset();
    return status;
  }
  void killSupervisor() {
    supervisor_->end(SIGKILL);
    supervisor_.reset();
  }

  nlohmann::json ask(const nlohmann::json& request) {
    return askSupervisor(folder(), request, std::chrono::minutes(15));
  }
  nlohmann::json process(const std::string& name) {
    const auto report = ask({{"do", "ps"}});
    for (const auto& one : report.at("processes"))
      if (one.at("name") == name) return one;
    return nlohmann::json::object();
  }
  pid_t pidOf(const std::string& name) { return process(name).value("pid", 0); }
  std::string stateOf(const std::string& name) { return process(name).value("state", "absent"); }
  void waitForState(const std::string& name, const std::string& state) {
    while (stateOf(name) != state) continue;
  }
  // Waits until the process is ready with another pid.
  void waitForNew(const std::string& name, pid_t before) {
    for (;;) {
      const auto now = process(name);
      const pid_t pid = now.value("pid", 0);
      if (now.value("state", "absent") == "ready" && pid != 0 && pid != before) return;
    }
  }
  // Sends an Int32 message, and returns whether the server has replied within this time.
  bool isReplying(const std::string& server,
                  std::chrono::seconds patience = std::chrono::hours(1)) {
    return mpf::test::runCommand(fmt::format("{} call {} int32 value=1 --timeout {} 2>&1", MPF,
                                             server, patience.count()))
               .status == 0;
  }
  CrateFolder folder() { return CrateFolder::of("lab"); }

  std::optional<mpf::test::Watchdog> watchdog_{std::in_place, "Supervisor"};
  mpf::test::TestBackplane backplane_;
  mpf::test::TemporaryFolder files_;
  std::optional<mpf::test::Program> supervisor_;

 private:
  bool isAnswering() {
    try {
      ask({{"do", "ps"}});
      return true;
    } catch (const std::runtime_error&) {
      return false;
    }
  }
};

}  // namespace mpf::crate::test
