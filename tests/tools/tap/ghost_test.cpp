// SPDX-License-Identifier: MIT
// `mpf replay --as-server`: a recording of a real server answers its clients.
#include "tests/tools/tap/tap_fixture.h"

namespace mpf::test {
namespace {

using testing::HasSubstr;

class GhostTest : public TapTest {};

TEST_F(GhostTest, RepliesAsTheRecordedServerDid) {
  {
    MessageServer server(backplane_, "echo");
    server.on<Int32>([](Int32& request) { request.value *= 2; });
    std::thread thread([&] { server.run(); });
    SyncClient client(backplane_, "echo");
    callMany(client, 0, 1);
    const auto tool = tap({"--write", file_, "--count", "20"});
    callMany(client, 0, 10);
    EXPECT_EQ(tool->end().status, 0);
    server.interrupt();
    thread.join();
  }
  Tool ghost({"replay", file_, "--as-server"}, backplane_.name());
  EXPECT_THAT(ghost.line(), HasSubstr("\"echo\" at location 0 replies as in"));

  SyncClient client(backplane_, "echo");
  for (const int value : {7, 3, 9, 0}) {
    auto reply = client.call(Int32Message({.value = value}), 1h);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply.message().tryAs<Int32>()->value, 2 * value);
  }
  EXPECT_FALSE(client.call(Float64Message({.value = 1}), 1h));
  ghost.signal(SIGTERM);
  const auto end = ghost.end();

  EXPECT_EQ(end.status, 0);
  EXPECT_THAT(end.out, HasSubstr("5 requests, 0 by the replies to a similar one, 1 refused as "
                                 "unknown, 0 not answered; 4 replies\n"));
}

TEST_F(GhostTest, AFileThatIsNotARecordingIsAnError) {
  std::ofstream(file_) << "a text that is not a recording, but long enough for frame headers: ";

  const auto ended = run({"replay", file_, "--as-server"});

  EXPECT_EQ(ended.status, 1);
  EXPECT_THAT(ended.err, HasSubstr("not a recording"));
}

}  // namespace
}  // namespace mpf::test
