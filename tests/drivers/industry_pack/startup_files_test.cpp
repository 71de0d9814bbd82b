// SPDX-License-Identifier: MIT
// Carriers in startup files of real users. MPF_CORPUS is their folder; without it the test looks
// beside this tree.
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gtest/gtest.h>
#include <regex>
#include <string>
#include <vector>

#include "drivers/industry_pack/carrier_parameters.h"

namespace mpf::test {
namespace {

struct CarrierLine {
  std::string where;  // file and line
  std::string kind;
  std::string parameters;
};

std::filesystem::path startupFolder() {
  const char* const said = std::getenv("MPF_CORPUS");
  return std::filesystem::path(said == nullptr ? MPF_CORPUS_NEARBY : said) / "startup";
}

// Lines that are commented out count, since users have written and used them.
void addLinesOf(const std::filesystem::path& file, std::vector<CarrierLine>& found) {
  static const std::regex kCommand(R"re(ipacAddCarrier\s*\(?\s*&(\w+)\s*,\s*"([^"]*)")re");
  static const std::regex kCommandOfKind(R"re((ipacAdd(?!Carrier)\w+)\s*\(?\s*"([^"]*)")re");
  std::ifstream text(file);
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    std::smatch match;
    if (std::regex_search(line, match, kCommand) || std::regex_search(line, match, kCommandOfKind))
      found.push_back({fmt::format("{}:{}", file.string(), number), match[1], match[2]});
  }
}

TEST(StartupFilesTest, HaveCarriersWithParametersThatAreUnderstood) {
  const auto folder = startupFolder();
  if (!std::filesystem::is_directory(folder))
    GTEST_SKIP() << "no startup files of users in " << folder;
  std::vector<CarrierLine> found;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) addLinesOf(entry.path(), found);
  }
  EXPECT_FALSE(found.empty());
  for (const auto& line : found) {
    EXPECT_NO_THROW(EXPECT_EQ(parseCarrierParameters(line.kind, line.parameters).sites.size(), 4U)
                    << line.where)
        << line.where << ": " << line.kind << " \"" << line.parameters << '"';
  }
}

}  // namespace
}  // namespace mpf::test
