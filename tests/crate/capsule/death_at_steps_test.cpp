// SPDX-License-Identifier: MIT
// A server dies at each step of its work, and some instructions after it: its capsule shows the
// request that was sent to it, wherever that was.
//
//   MPF_TEST_INSTRUCTIONS=40 capsule_test --gtest_filter='DeathAtSteps*'
#include <sys/prctl.h>

#include <set>

#include <mpf/message_server.h>

#include "tests/crate/capsule/crash_fixture.h"
#include "tests/tools/torture/may_trace.h"
#include "tools/torture/processes.h"
#include "tools/torture/tracee.h"

namespace mpf::crate::test {
namespace {

using torture::Marks;
using torture::Place;
using torture::Processes;
using torture::Tracee;

constexpr std::int32_t kValue = 4711;

class DeathAtSteps : public CrashTest {
 protected:
  void SetUp() override {
    if (!mpf::test::mayTrace())
      GTEST_SKIP() << "this host does not let a process trace its children";
  }
  // Returns the capsule of a server that died at the place while it had a request; nothing when it
  // did not come there before it had replied.
  std::optional<nlohmann::ordered_json> dieAt(const Place& place) {
    Processes processes;
    pid_ = processes.startHeld([name = backplane_.name()] {
      MessageServer server(Backplane::attach(name), "victim");
      server.on<Int32>([](Int32& request) { request.status = 1; });
      server.run();
      return 0;
    });
    Tracee tracee(pid_, marks_);
    processes.setTracee(&tracee);
    processes.openGate();
    witness_.watch(pid_, startTicksOfVictim(pid_));
    const auto turn = [&] {
      processes.handleEvents(std::chrono::milliseconds(0));
      step();
    };
    client_.emplace(dispatcher_, [this](Message&& reply) { take(reply); });
    client_->bind("victim");
    while (!client_->isConnected()) turn();
    witness_.look();
    tracee.aim(place);
    const auto before = replies_;
    send(kValue);
    while (!tracee.isThere() && replies_ == before && !tracee.isGone()) turn();
    const bool isThere = tracee.isThere();
    tracee.kill();
    while (!tracee.isGone()) processes.handleEvents(std::chrono::hours(1));
    auto tree = capsule(tracee.status());
    while (client_->isConnected()) step();
    client_.reset();
    witness_.forget(pid_);
    return isThere ? std::optional(std::move(tree)) : std::nullopt;
  }

  const Marks marks_ = Marks::ofThisProgram();
};

// Whether the request is among the last messages of the server's links.
bool showsTheRequest(const nlohmann::ordered_json& server) {
  for (const auto& link : server.at("links")) {
    for (const auto& request : link.at("requests").at("messages")) {
      if (request.contains("message") && request.at("message").at("value") == kValue) return true;
    }
  }
  return false;
}

TEST_F(DeathAtSteps, EachCapsuleShowsTheRequest) {
  const auto* const set = std::getenv("MPF_TEST_INSTRUCTIONS");
  const auto instructions = set == nullptr ? 2U : static_cast<unsigned>(std::stoul(set));
  std::set<std::string> steps;
  int deaths = 0;
  int handling = 0;
  for (const auto& [mark, addresses] : marks_.byName()) {
    for (unsigned after = 0; after < instructions; ++after) {
      SCOPED_TRACE(mark + " and instructions " + std::to_string(after));
      const auto tree = dieAt({.mark = mark, .hit = 1, .instructions = after});
      if (!tree) break;
      ++deaths;
      steps.insert(mark);
      ASSERT_EQ(tree->at("servers").size(), 1U) << tree->dump(1);
      const auto& server = tree->at("servers")[0];
      ASSERT_TRUE(showsTheRequest(server)) << tree->dump(1);
      const auto& work = server.at("handling");
      if (!work.is_object()) continue;
      ++handling;
      ASSERT_EQ(work.at("candidates").at(0).at("request").at("message").at("value"), kValue);
    }
  }
  RecordProperty("steps", static_cast<int>(steps.size()));
  RecordProperty("deaths", deaths);
  RecordProperty("handling", handling);
  std::printf("%zu steps, %d deaths, %d of them while the request was in work\n", steps.size(),
              deaths, handling);
  // At the steps behind these, the client may see the reply before the server dies.
  EXPECT_THAT(steps, testing::IsSupersetOf({"message_counted", "request_taken", "slot_written"}));
  EXPECT_GT(handling, 0);
}

}  // namespace
}  // namespace mpf::crate::test
