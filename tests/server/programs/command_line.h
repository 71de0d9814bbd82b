// SPDX-License-Identifier: MIT
// statusOf(), usageErrorOf(): run the parser of a program's command line, without the program.
#pragma once

#include <gtest/gtest.h>
#include <optional>
#include <string>
#include <vector>

namespace mpf::test {

// Calls parse(argc, argv) with `words` behind the program's name. Returns its result: the exit
// status, or nullopt when the program is to continue.
template <class Parse>
std::optional<int> statusOf(const Parse& parse, std::vector<std::string> words) {
  std::string program = "program";
  std::vector<char*> argv{program.data()};
  for (auto& word : words) argv.push_back(word.data());
  return parse(static_cast<int>(argv.size()), argv.data());
}

// Expects a usage error. Returns what it says on stderr.
template <class Parse>
std::string usageErrorOf(const Parse& parse, const std::vector<std::string>& words) {
  testing::internal::CaptureStderr();
  const auto status = statusOf(parse, words);
  auto complaint = testing::internal::GetCapturedStderr();
  EXPECT_EQ(status, 2) << testing::PrintToString(words);
  return complaint;
}

}  // namespace mpf::test
