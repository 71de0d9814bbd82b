// SPDX-License-Identifier: MIT
// `mpf clean`: removes what dead processes left, and nothing else.
#include <sys/stat.h>

#include <filesystem>

#include <mpf/shm/segment_name.h>
#include <mpf/tests/support/victim.h>
#include <mpf/tests/tools/tools_fixture.h>

namespace mpf::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class CleanTest : public ToolsTest {};

TEST_F(CleanTest, WithoutAnythingDeadItSaysSo) {
  const EchoThread echo(backplane_, "echo");

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0);
  EXPECT_EQ(ended.out, "nothing to remove: no dead process left anything\n");
  EXPECT_EQ(run({"call", "echo", "int32", "--timeout", "100"}).status, 0);
}

TEST_F(CleanTest, RemovesWhatIsDeadAndOnlyThat) {
  const EchoThread living(backplane_, "living");
  SyncClient client(backplane_, "living", 0);
  ASSERT_TRUE(client.call(Int32Message(), 60s));
  const auto before = backplane_.segmentNames();
  Victim server("serve", backplane_.name());
  ASSERT_EQ(server.line(), "open");
  Victim flood("flood", backplane_.name());
  ASSERT_EQ(flood.line(), "connected");
  server.signal(SIGSTOP);
  flood.end(SIGKILL);
  server.end(SIGKILL);
  std::set<std::string> dead;
  for (const auto& name : backplane_.segmentNames()) {
    if (std::ranges::find(before, name) == before.end()) dead.insert(name);
  }
  ASSERT_FALSE(dead.empty());

  const auto ended = run({"clean"});

  EXPECT_EQ(ended.status, 0);
  for (const auto& name : dead) EXPECT_THAT(ended.out, HasSubstr("removed " + segments::path(name) + "\n"));
  EXPECT_EQ(std::ranges::count(ended.out, '\n'), static_cast<std::ptrdiff_t>(dead.size()));
  EXPECT_THAT(backplane_.segmentNames(), testing::UnorderedElementsAreArray(before));
  EXPECT_TRUE(client.call(Int32Message(), 60s));
  EXPECT_EQ(run({"clean"}).out, "nothing to remove: no dead process left anything\n");
}

}  // namespace
}  // namespace mpf::test
