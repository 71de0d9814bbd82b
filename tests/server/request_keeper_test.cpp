// SPDX-License-Identifier: MIT
// RequestKeeper: refuses requests whose handles are destroyed, until its server ends.
#include "server/request_keeper.h"

#include <signal.h>
#include <sys/prctl.h>

#include <gtest/gtest.h>

#include "tests/base/child_process.h"
#include "tests/server/server_parts_fixture.h"

namespace mpf::test {
namespace {

class RequestKeeperTest : public ServerPartsTest {
 protected:
  // A handle of a request that the server has taken.
  Int32Message request(std::uint32_t requestId) {
    noteRequest(connection_, requestId);
    Int32Message message;
    message.setRoute(connection_.routeOf(requestId, &keeper_));
    return message;
  }

  Link& link_ = createLink();
  Connection& connection_ = accept(link_);
  RequestKeeper& keeper_ = RequestKeeper::make(replies_);
};

TEST_F(RequestKeeperTest, RefusesARequestWhoseHandleIsDestroyed) {
  {
    const auto dropped = request(3);
  }

  const auto fate = take(link_);
  EXPECT_EQ(fate.type, static_cast<std::uint16_t>(MessageType::requestFate));
  EXPECT_EQ(fate.requestId, 3u);
}

TEST_F(RequestKeeperTest, DoesNothingForARequestThatHasAReply) {
  {
    auto replied = request(3);
    ASSERT_EQ(replies_.send(replied), ReplyResult::sent);
  }

  EXPECT_EQ(take(link_).type, static_cast<std::uint16_t>(MessageType::int32));
  EXPECT_FALSE(link_.incoming().hasMessage());
}

TEST_F(RequestKeeperTest, DoesNothingAfterItsServerHasEnded) {
  {
    const auto outlives = request(3);
    keeper_.leave();
  }

  EXPECT_FALSE(link_.incoming().hasMessage());
}

TEST_F(RequestKeeperTest, WaitsForNoLockInTheChildOfAFork) {
  auto inherited = request(3);
  {
    const BiasedLock::Guard lock(*connection_.lock);  // never released in the child
    const auto status = endOf([&] {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const auto body = ReplySender::allocate(inherited.route(), 10'000);
      EXPECT_EQ(body.lender, &heapLender());
      body.lender->takeBack(body.data, body.capacity);
      inherited.reset();
      return HasFailure() ? 1 : 0;
    });
    EXPECT_EQ(status, 0);
  }
  EXPECT_FALSE(link_.incoming().hasMessage());
}

}  // namespace
}  // namespace mpf::test
