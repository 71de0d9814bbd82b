// SPDX-License-Identifier: MIT
// Capsules of servers that died: each names the request that was being handled.
#include "crate/capsule/capsule.h"

#include <gmock/gmock.h>

#include "crate/capsule/capsule_store.h"
#include "tests/crate/capsule/crash_fixture.h"
#include "tests/support/command.h"

namespace mpf::crate::test {
namespace {

using Tree = nlohmann::ordered_json;

class CapsuleTest : public CrashTest {};

// Functions that are recursive would end with SIGSEGV.
const std::string kDeepList = std::string(1'000'000, '[') + std::string(1'000'000, ']');

// MPF_TEST_CAPSULES servers die, each in the middle of another request, and leave as many files.
TEST_F(CapsuleTest, NamesTheRequestThatWasBeingHandled) {
  const auto* const wanted = std::getenv("MPF_TEST_CAPSULES");
  const int states = wanted == nullptr ? 100 : std::atoi(wanted);
  const CapsuleStore store(files_.path() / "capsules", 1'000'000, ~std::uint64_t{0});
  for (int state = 0; state < states; ++state) {
    SCOPED_TRACE(state);
    start();
    exchange(state % 70);
    send(1000 + state, 9);
    send(5000 + state);  // waits behind it
    const auto status = server_.wait();
    while (client_->isConnected()) step();  // the client removes the files

    const auto tree = readCapsule(store.add(capsule(status)));

    EXPECT_EQ(tree.at("cause").at("name"), "SIGSEGV");
    ASSERT_EQ(tree.at("servers").size(), 1u);
    const auto& server = tree.at("servers")[0];
    ASSERT_TRUE(server.at("handling").is_object()) << server.dump(1);
    const auto& candidates = server.at("handling").at("candidates");
    ASSERT_EQ(candidates.size(), 1u) << server.dump(1);
    EXPECT_EQ(candidates[0].at("request").at("message").at("value"), 1000 + state);
    EXPECT_EQ(candidates[0].at("clientPid"), ::getpid());
    EXPECT_EQ(candidates[0].at("request").at("answered"), "no");
    EXPECT_EQ(server.at("counters").at("received"), state % 70 + 1);
    client_.reset();
    witness_.forget(pid_);
  }
  EXPECT_EQ(store.list().size(), static_cast<std::size_t>(states));
}

TEST_F(CapsuleTest, SaysThatNoRequestWasBeingHandled) {
  start();
  exchange(3);
  while (isHandling()) step();

  const auto tree = capsule(server_.end(SIGSEGV));

  EXPECT_TRUE(tree.at("servers").at(0).at("handling").is_null());
}

TEST_F(CapsuleTest, IsShownByACommand) {
  start();
  send(1, 9);
  const auto status = server_.wait();
  const auto file = CapsuleStore(files_.path()).add(capsule(status));
  const auto run = [](const std::string& arguments) {
    return mpf::test::runCommand(std::string(MPF) + " capsule " + arguments).output;
  };

  EXPECT_THAT(run(file), testing::StartsWith("\"victim\" died by SIGSEGV"));
  EXPECT_EQ(Tree::parse(run(file + " --json")), readCapsule(file));
  EXPECT_THAT(run("--folder " + files_.path().string()), testing::HasSubstr(file));
  EXPECT_EQ(
      run("dac 2>&1"),
      "mpf capsule: dac: no such file; `mpf capsule` without a file lists the crash reports\n");
}

TEST_F(CapsuleTest, ReportsADamagedFileByName) {
  const auto garbage = files_.write("a", "{\"mpfCapsule\": 1, ");
  const auto newer = files_.write("b", "{\"mpfCapsule\": 7}");
  const auto other = files_.write("c", "[]");
  const auto deep = files_.write("d", "{\"mpfCapsule\": 1, \"log\": " + kDeepList + "}");

  for (const auto& file : {garbage, newer, other, deep})
    EXPECT_THAT([&] { static_cast<void>(readCapsule(file)); },
                testing::ThrowsMessage<std::runtime_error>(testing::StartsWith(file)));
}

TEST_F(CapsuleTest, ADamagedFileDoesNotEndTheList) {
  const auto folder = files_.path() / "capsules";
  const auto file = CapsuleStore(folder).add({{"mpfCapsule", 1}, {"process", "sound"}});
  static_cast<void>(files_.write("capsules/0.capsule.json", "{\"log\": " + kDeepList + "}"));

  const auto result =
      mpf::test::runCommand(std::string(MPF) + " capsule --json --folder " + folder.string());

  EXPECT_EQ(result.status, 0);
  const auto list = Tree::parse(result.output);
  ASSERT_EQ(list.size(), 2u);
  EXPECT_THAT(list[0].at("problem"), testing::HasSubstr("more than 100 nested lists"));
  EXPECT_EQ(list[1].at("file"), file);
}

TEST_F(CapsuleTest, ContainsTheEndOfTheLog) {
  const auto log = files_.write("log", std::string(100, 'a') + "last\x1b");
  Death death;
  death.log = log;
  CapsuleLimits limits;
  limits.logBytes = 5;

  const auto tree = capsuleOf(death, nullptr, limits);

  EXPECT_EQ(tree.at("log").at("text"), "last\\x1b");
  EXPECT_EQ(tree.at("log").at("leftOutBytes"), 100);
}

}  // namespace
}  // namespace mpf::crate::test
