// SPDX-License-Identifier: MIT
// LinkTest: a link between a client's endpoint and a server's.
#pragma once

#include <cstring>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/shm/endpoint_pair.h"
#include "tests/shm/shm_fixture.h"

namespace mpf::test {

class LinkTest : public ShmTest {
 protected:
  void makeEnds(Offer offer = {}) {
    server_.emplace(backplane_, "server", WaitMode::block, offer);
    client_.emplace(backplane_, "", WaitMode::block);
  }
  Connected makeLink(Offer offer = {}) {
    makeEnds(offer);
    return connect(*client_, *server_);
  }
  void TearDown() override {
    client_.reset();
    server_.reset();
    ShmTest::TearDown();
  }
  static std::vector<std::byte> filled(std::size_t bytes) {
    std::vector<std::byte> body(bytes);
    for (std::size_t i = 0; i < bytes; ++i) body[i] = static_cast<std::byte>(i * 7);
    return body;
  }
  static LinkSend sendBody(Link& link, std::span<const std::byte> body, Link::Limits limits = {}) {
    Envelope envelope{.requestId = 1};
    return link.trySend(envelope, body, limits);
  }
  // Takes the next message and returns its whole body. Returns its chunk to the peer.
  static std::vector<std::byte> take(Link& link) {
    EXPECT_TRUE(link.incoming().hasMessage());
    const auto envelope = link.incoming().begin();
    std::vector<std::byte> body(envelope.bodyBytes);
    if ((envelope.flags & layout::kSlotChunk) == 0) {
      link.incoming().copyBody(body);
    } else if (const auto chunk = link.tryChunk(envelope.bodyBytes)) {
      std::memcpy(body.data(), chunk->data, body.size());
      link.release(chunk->data);
    } else {
      ADD_FAILURE() << "no chunk";
    }
    link.incoming().end();
    return body;
  }
  // The error with which the server refuses a link after its client has made this change.
  std::string refusal(const std::function<void(layout::SegmentHeader&)>& change) {
    const auto link = makeLink();
    change(
        Segment::tryOpen(link.client.name(), layout::SegmentKind::link, Segment::Access::readWrite)
            ->sharedHeader());
    return whatOf<SegmentError>(
        [&] { Link::tryOpen(name(), link.client.name(), server_->endpoint.window()); });
  }

  std::optional<End> server_;
  std::optional<End> client_;
};

}  // namespace mpf::test
