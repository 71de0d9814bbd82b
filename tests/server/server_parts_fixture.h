// SPDX-License-Identifier: MIT
// ServerPartsTest: the parts of a server at the endpoint `server_`, and the endpoint of a client
// whose links the test creates and reads itself.
#pragma once

#include <mpf/message_of.h>

#include "server/acceptor.h"
#include "server/connections.h"
#include "server/reply_sender.h"
#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {

class ServerPartsTest : public ShmTest {
 protected:
  // Creates a link to the server, as a client does before it knocks.
  Link& createLink() {
    auto& endpoint = client_->endpoint;
    const auto index = endpoint.tryReserve().value();
    auto server = endpoint.peers().tryOpen(serverName(), layout::SegmentKind::serverWindow);
    return client_->keep(index, Link::create(name(), endpoint.window(), index, std::move(server)));
  }
  static void knock(Link& link) { link.peer()->knock(link.header().incarnation); }
  // The connection for a link that was created and accepted.
  Connection& accept(Link& link) {
    knock(link);
    acceptor_.acceptAll();
    EXPECT_EQ(link.peerState(), layout::LinkState::open);
    return *connections_.all()[link.control().serverIndex.load(std::memory_order_relaxed)];
  }
  // The route of a request that the server has taken from this connection.
  static Route noteRequest(Connection& connection, std::uint32_t requestId) {
    EXPECT_TRUE(connection.tryNoteRequest(requestId));
    return connection.routeOf(requestId, nullptr);
  }
  // The next message that the client receives; an empty envelope if no message waits.
  static Envelope take(Link& link) {
    if (!link.incoming().hasMessage()) return {};
    const auto envelope = link.incoming().begin();
    link.incoming().end();
    return envelope;
  }
  void SetUp() override {
    ShmTest::SetUp();
    counts_.noteServerThread();
  }
  layout::WindowControl& control() { return server_->endpoint.control(); }
  void TearDown() override {
    static_cast<void>(connections_.closeAll());
    client_.reset();
    server_.reset();
    ShmTest::TearDown();
  }

  std::optional<End> server_{std::in_place, backplane_, "server"};
  std::optional<End> client_{std::in_place, backplane_, ""};
  Connections connections_{server_->endpoint};
  Acceptor acceptor_{server_->endpoint, connections_};
  ReplyCounts counts_{control()};
  ReplySender replies_{counts_, false};
};

inline std::uint64_t valueOf(const layout::Word64& word) {
  return word.load(std::memory_order_relaxed);
}

}  // namespace mpf::test
