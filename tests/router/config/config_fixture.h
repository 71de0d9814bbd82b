// SPDX-License-Identifier: MIT
// ConfigTest: loads configurations from a folder of the test, and returns their errors.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <regex>
#include <string>
#include <vector>

#include "base/toml/config_errors.h"
#include "router/config/router_config.h"
#include "tests/support/temporary_folder.h"

namespace mpf::router::test {

// Entries of a file.
// NOLINTBEGIN(modernize-raw-string-literal)
inline const std::string kServe = "[[serve]]\nlocation = 1\n";
inline const std::string kRemote =
    "[[remote]]\nlocations = [2]\naddress = \"a:1\"\nsecurity = \"plain\"\n";
// NOLINTEND(modernize-raw-string-literal)

// An invalid file.
struct Wrong {
  std::string text;
  std::string complaint;  // without "router.toml:" and the column
};

class ConfigTest : public testing::Test {
 protected:
  RouterConfig load(const std::string& text) {
    return loadConfig(folder_.write("router.toml", text));
  }

  // Returns the errors of a file without their columns, or "nothing".
  std::string complaintOf(const std::string& text) {
    try {
      static_cast<void>(load(text));
      return "nothing";
    } catch (const ConfigError& error) {
      return std::regex_replace(withoutFolder(error.what()), std::regex("(toml:[0-9]+):[0-9]+"),
                                "$1");
    }
  }
  void expectComplaints(const std::vector<Wrong>& all) {
    for (const auto& [text, complaint] : all)
      EXPECT_EQ(complaintOf(text), "router.toml:" + complaint) << text;
  }
  [[nodiscard]] std::string withoutFolder(std::string text) const {
    const auto prefix = folder_.path().string() + "/";
    for (auto at = text.find(prefix); at != std::string::npos; at = text.find(prefix))
      text.erase(at, prefix.size());
    return text;
  }

  mpf::test::TemporaryFolder folder_;
};

}  // namespace mpf::router::test
