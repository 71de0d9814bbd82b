// SPDX-License-Identifier: MIT
// ConfigTest: loads configurations from a folder of the test, and returns their errors.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "router/config/router_config.h"
#include "tests/support/temporary_folder.h"

namespace mpf::router::test {

class ConfigTest : public testing::Test {
 protected:
  RouterConfig load(const std::string& text) {
    return loadConfig(folder_.write("router.toml", text));
  }

  // Returns the error of a file, or "nothing".
  std::string complaintOf(const std::string& text) {
    try {
      static_cast<void>(load(text));
      return "nothing";
    } catch (const ConfigError& error) {
      return withoutFolder(error.what());
    }
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
