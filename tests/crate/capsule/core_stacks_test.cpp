// SPDX-License-Identifier: MIT
#include "crate/capsule/core_stacks.h"

#include <gmock/gmock.h>

#include "crate/capsule/capsule_text.h"
#include "crate/capsule/core_file.h"
#include "tests/crate/capsule/crash_fixture.h"

namespace mpf::crate::test {
namespace {

using testing::HasSubstr;

class CoreStacksTest : public CrashTest {
 protected:
  // In a folder of its own: where every core has the name "core", those of other tests that run at
  // the same time would take its place.
  void SetUp() override {
    ::setenv("MPF_TEST_CORES", "1", 1);
    std::filesystem::current_path(files_.path());
  }
  void TearDown() override {
    ::unsetenv("MPF_TEST_CORES");
    std::filesystem::current_path(folderBefore_);
  }
  // Makes the server die in the middle of a request.
  nlohmann::ordered_json die(std::int32_t cmd) {
    start();
    send(1, cmd);
    auto tree = capsule(server_.wait());
    if (const auto& core = tree.at("core"); core.is_object()) core_ = core.value("file", "");
    return tree;
  }
  const std::filesystem::path folderBefore_ = std::filesystem::current_path();
  std::string core_;
};

#define MPF_NEEDS_A_CORE(capsule) \
  if (core_.empty()) GTEST_SKIP() << "this host keeps no cores: " << (capsule).at("core")

TEST_F(CoreStacksTest, ACoreTellsWhereTheProcessWasAndWhy) {
  const auto tree = die(10);
  MPF_NEEDS_A_CORE(tree);

  const auto& core = tree.at("core");
  EXPECT_EQ(core.at("code"), SEGV_MAPERR);
  EXPECT_EQ(core.at("address"), 0x10);
  const auto& frames = core.at("threads").at(0).at("frames");
  EXPECT_THAT(frames.at(0).at("function").get<std::string>(), HasSubstr("writeTo"));
  EXPECT_THAT(frames.at(0).at("at").get<std::string>(), HasSubstr("crashing_server.cpp:"));
  EXPECT_THAT(frames.back().at("function").get<std::string>(), HasSubstr("_start"));
  const auto text = capsuleText(tree);
  EXPECT_THAT(text, HasSubstr("which received SIGSEGV: nothing is mapped at 0x10\n"));
  EXPECT_THAT(text, HasSubstr("    writeTo(int)"));
}

TEST_F(CoreStacksTest, ACoreIsOfItsProcess) {
  const auto tree = die(9);
  MPF_NEEDS_A_CORE(tree);

  EXPECT_EQ(pidOfCore(core_), pid_);
  EXPECT_THAT(capsuleText(tree), HasSubstr("which received SIGSEGV sent by a process\n"));
}

TEST_F(CoreStacksTest, OtherFilesAreNoCores) {
  const auto text = files_.write("text", "not a core");

  EXPECT_FALSE(pidOfCore(text));
  EXPECT_FALSE(pidOfCore(MPF_TEST_CRASHING_SERVER)) << "a program is no core";
  EXPECT_FALSE(pidOfCore("/nonexistent"));
  EXPECT_THAT([&] { static_cast<void>(readCore(text)); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr(text + " is not a core")));
}

// A core that the kernel could not write whole, or that was damaged later.
TEST_F(CoreStacksTest, ADamagedCoreIsAProblemInWords) {
  const auto tree = die(10);
  MPF_NEEDS_A_CORE(tree);

  nlohmann::ordered_json read;
  for (const auto size : {100'000, 20'000, 4096, 64}) {
    std::filesystem::resize_file(core_, static_cast<std::uintmax_t>(size));
    read = describeCore({.pid = pid_, .folder = std::filesystem::current_path()},
                        std::chrono::seconds(60));
    EXPECT_NE(read.contains("problem"), read.contains("threads")) << size << ": " << read;
  }
  EXPECT_TRUE(read.contains("problem")) << "the last one has only a header: " << read;
}

}  // namespace
}  // namespace mpf::crate::test
