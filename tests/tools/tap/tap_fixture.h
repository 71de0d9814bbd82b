// SPDX-License-Identifier: MIT
// TapTest: runs `mpf tap`, and has a file for its recording.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <mpf/sync_client.h>

#include "tests/tools/tools_fixture.h"

namespace mpf::test {

class TapTest : public ToolsTest {
 protected:
  void TearDown() override {
    std::filesystem::remove(file_);
    ToolsTest::TearDown();
  }
  // Returns when the tap follows `links` links of the server.
  std::unique_ptr<Tool> tap(std::vector<std::string> more, int links = 1) const {
    std::vector<std::string> arguments{"tap", "echo"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto tool = std::make_unique<Tool>(arguments, backplane_.name());
    while (tool->err().find("mpf tap: \"echo\" has " + std::to_string(links)) == std::string::npos)
      std::this_thread::yield();
    return tool;
  }
  static void callMany(SyncClient& client, int from, int to) {
    for (int i = from; i < to; ++i) {
      const auto answer = client.call(Int32Message({.value = i}), 1h);
      ASSERT_TRUE(answer);
    }
  }
  static std::vector<nlohmann::json> objects(const std::string& lines) {
    std::vector<nlohmann::json> all;
    std::istringstream stream(lines);
    for (std::string line; std::getline(stream, line);) all.push_back(nlohmann::json::parse(line));
    return all;
  }
  // The messages of one direction.
  static std::vector<nlohmann::json> messages(const std::vector<nlohmann::json>& all,
                                              const std::string& direction) {
    std::vector<nlohmann::json> some;
    for (const auto& object : all) {
      if (object.value("direction", "") == direction) some.push_back(object.at("message"));
    }
    return some;
  }

  std::string file_ = std::filesystem::temp_directory_path() / (backplane_.name() + ".mpf");
};

}  // namespace mpf::test
