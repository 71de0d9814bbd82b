// SPDX-License-Identifier: MIT
// CrateTextTest: reads crates from texts, and returns their errors.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "crate/config/read_crate.h"
#include "tests/support/temporary_folder.h"

namespace mpf::crate::test {

class CrateTextTest : public testing::Test {
 protected:
  Crate read(const std::string& text) { return readCrate(folder_.write("lab.toml", text)); }
  // The errors of a file without its folder; empty: it has none.
  std::string errorsOf(const std::string& text) {
    try {
      static_cast<void>(read(text));
      return {};
    } catch (const ConfigError& error) {
      std::string all = error.what();
      const auto prefix = folder_.path().string() + "/";
      for (auto at = all.find(prefix); at != std::string::npos; at = all.find(prefix))
        all.erase(at, prefix.size());
      return all;
    }
  }

  mpf::test::TemporaryFolder folder_;
};

}  // namespace mpf::crate::test
