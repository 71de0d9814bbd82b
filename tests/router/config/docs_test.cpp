// SPDX-License-Identifier: MIT
// docs/router-configuration.md: its files can be loaded, and its list has each key with its
// default.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <grp.h>
#include <iterator>
#include <set>
#include <sstream>

#include "router/config/limit_text.h"
#include "tests/router/certificates.h"
#include "tests/router/config/config_fixture.h"

namespace mpf::router::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

class RouterDocs : public ConfigTest {
 protected:
  // The ```toml blocks, with a group that exists on this host.
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> all;
    constexpr std::string_view kBegin = "```toml\n";
    for (auto at = page_.find(kBegin); at != std::string::npos; at = page_.find(kBegin, at)) {
      at += kBegin.size();
      auto text = page_.substr(at, page_.find("```", at) - at);
      if (const auto group = text.find("\"mpf\""); group != std::string::npos) {
        text.replace(group, std::string_view("\"mpf\"").size(),
                     std::string("\"") + ::getgrgid(::getegid())->gr_name + "\"");
      }
      all.push_back(std::move(text));
    }
    return all;
  }
  // Makes the TLS files under the names that the page uses.
  void makeCertificates() {
    const Certificates lab(folder_, "lab");
    std::filesystem::create_directory(folder_.file("tls"));
    std::filesystem::copy(lab.authorities(), folder_.file("tls/lab.pem"));
    for (const std::string host : {"a", "b"}) {
      const auto made = lab.files(host + ".lab");
      std::filesystem::rename(made.certificate, folder_.file("tls/" + host + ".pem"));
      std::filesystem::rename(made.key, folder_.file("tls/" + host + ".key"));
    }
  }
  // The keys at the beginnings of lines.
  static std::set<std::string> keysIn(const std::string& text) {
    std::set<std::string> keys;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (const auto end = line.find(" = "); end != std::string::npos && line[0] != '#')
        keys.insert(line.substr(0, end));
    }
    return keys;
  }
  std::string page_ = [] {
    std::ifstream stream(MPF_TEST_ROUTER_MD);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  }();
};

TEST_F(RouterDocs, ShowFilesThatCanBeLoaded) {
  makeCertificates();
  const auto all = files();
  EXPECT_EQ(all.size(), 4U);

  for (const auto& file : all) EXPECT_EQ(complaintOf(file), "nothing") << file;
}

TEST_F(RouterDocs, ShowEveryKeyInTheFirstFileAndNoDefault) {
  makeCertificates();
  const auto file = files().front();
  const std::set<std::string> keys = keysIn(file);
  const auto config = load(file);

  for (const auto& key : keys)
    EXPECT_THAT(page_, ContainsRegex("\n- `" + key + "`(:|, default )")) << "not in the list";
  for (const auto& name : limitNames()) {
    EXPECT_TRUE(keys.contains(name)) << name;
    EXPECT_NE(limitText(config.limits, name), limitText({}, name)) << name << " has its default";
  }
  const auto end = page_.find("## From the old commands");
  for (auto at = page_.find("\n- `"); at < end; at = page_.find("\n- `", at + 1)) {
    const auto key = page_.substr(at + 4, page_.find('`', at + 4) - at - 4);
    EXPECT_TRUE(keys.contains(key)) << key << " is in the list alone";
  }
}

// The error for an unknown key lists all keys that the code reads.
TEST_F(RouterDocs, HaveEveryKeyThatTheProgramReads) {
  const auto keys = keysIn(files().front());
  for (const std::string table : {"", "[tls]\n", "[limits]\n", "[[serve]]\n", "[[listen]]\n",
                                  "[[remote]]\n", "[[allow]]\n"}) {
    const auto complaints = complaintOf(table + "qqqqqqqqqqqqqqqqqq = 1\n");
    constexpr std::string_view kBegin = "the keys are ";
    ASSERT_THAT(complaints, HasSubstr(kBegin));
    const auto begin = complaints.find(kBegin) + kBegin.size();
    std::istringstream known(complaints.substr(begin, complaints.find('\n', begin) - begin));
    for (std::string key; known >> key;) {
      if (key.ends_with(',')) key.pop_back();
      EXPECT_TRUE(keys.contains(key) || page_.find("[" + key + "]") != std::string::npos) << key;
    }
  }
}

TEST_F(RouterDocs, ShowTheDefaultsOfLimits) {
  for (const auto& name : limitNames()) {
    const auto text = limitText({}, name);
    const auto isNumber = text.find_first_not_of("0123456789") == std::string::npos;
    EXPECT_THAT(page_, HasSubstr("\n- `" + name + "`, default `" +
                                 (isNumber ? text : "\"" + text + "\"") + "`: "))
        << name;
  }
}

}  // namespace
}  // namespace mpf::router::test
