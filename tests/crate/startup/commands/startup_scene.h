// SPDX-License-Identifier: MIT
// StartupScene: reads startup files from texts.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <string_view>
#include <vector>

#include "base/toml/config_errors.h"
#include "crate/startup/commands/read_startup.h"
#include "tests/support/temporary_folder.h"

namespace mpf::test {

// A carrier "ipac", as its first line in most files.
inline const std::string kCarrier =
    "ipacAddCarrier(&vipc616_01, \"0x3000,0xa0000000\")\ninitIpacCarrier(\"ipac\", 0)\n";

class StartupScene : public testing::Test {
 protected:
  // On device models.
  startup::Startup read(const std::string& text) {
    return startup::readStartup(folder_.write("st.cmd", text), options_);
  }
  // "LINE:COLUMN: text" of the first error, without the line of the file; empty: no error.
  std::string errorOf(const std::string& text) {
    try {
      static_cast<void>(read(text));
      return {};
    } catch (const ConfigError& error) {
      std::string first = error.what();
      first = first.substr(0, first.find('\n'));
      const auto file = folder_.file("st.cmd") + ":";
      return first.starts_with(file) ? first.substr(file.size()) : first;
    }
  }
  // The settings of the process `name`, as "key=value" in their order.
  static std::vector<std::string> settingsOf(const startup::Startup& startup,
                                             std::string_view name) {
    std::vector<std::string> settings;
    for (const auto& process : startup.crate.processes) {
      if (process.name != name) continue;
      for (const auto& setting : process.settings)
        for (const auto& value : setting.values) settings.push_back(setting.key + "=" + value);
    }
    return settings;
  }
  // Warnings and notes.
  static std::vector<std::string> remarksOf(const startup::Startup& startup) {
    std::vector<std::string> texts;
    for (const auto& diagnostic : startup.diagnostics.all()) texts.push_back(diagnostic.text);
    return texts;
  }

  TemporaryFolder folder_;
  startup::StartupOptions options_{.carriers = {{"", "model"}}, .iocFile = "ioc.cmd"};
};

}  // namespace mpf::test
