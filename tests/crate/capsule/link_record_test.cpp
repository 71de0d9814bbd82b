// SPDX-License-Identifier: MIT
// LinkRecord: messages of links, and files that hold anything.
#include "crate/capsule/link_record.h"

#include <fcntl.h>

#include "tests/crate/capsule/crash_fixture.h"

namespace mpf::crate::test {
namespace {

class LinkRecordTest : public CrashTest {
 protected:
  const WitnessedLink& link() {
    return witness_.find(pid_)->windows.begin()->second.links.begin()->second;
  }
};

TEST_F(LinkRecordTest, HasTheLastMessagesAndTheirReplies) {
  start();
  exchange(5);

  const auto record = LinkRecord::of(link(), 3);

  const auto& requests = record.tree.at("requests");
  EXPECT_EQ(requests.at("sent"), 5);
  EXPECT_EQ(requests.at("unanswered"), 0);
  ASSERT_EQ(requests.at("messages").size(), 3u);
  EXPECT_EQ(requests.at("messages")[0].at("message").at("value"), 2);
  EXPECT_EQ(record.tree.at("replies").at("messages").size(), 3u);
  ASSERT_TRUE(record.lastTaken);
  EXPECT_EQ(record.lastTaken->at("message").at("value"), 4);
  EXPECT_EQ(record.lastTaken->at("answered"), "yes");
}

TEST_F(LinkRecordTest, ShowsWhatAFileThatIsNotALinkLacks) {
  WitnessedLink garbage;
  garbage.name = "x";
  garbage.file.reset(::open(files_.write("x", std::string(5000, 'x')).c_str(), O_RDONLY));

  EXPECT_TRUE(LinkRecord::of(garbage, 3).tree.contains("problem"));
}

}  // namespace
}  // namespace mpf::crate::test
