// SPDX-License-Identifier: MIT
#include "router/transport/refused_peers.h"

#include <array>
#include <capnp/message.h>
#include <capnp/serialize-async.h>

#include "router/transport/kj_text.h"

namespace mpf::router {
namespace {

// Discards what the peer sends. If it stayed unread, the kernel would reset the connection, and the
// peer might not receive the farewell.
kj::Promise<void> readToEnd(kj::AsyncIoStream& caller) {
  constexpr std::size_t kReadBytes = 4096;
  auto room = kj::heapArray<kj::byte>(kReadBytes);
  auto read = caller.tryRead(room.begin(), 1, room.size());
  return read.attach(kj::mv(room)).then([&caller](std::size_t bytes) -> kj::Promise<void> {
    if (bytes == 0) return kj::READY_NOW;
    return readToEnd(caller);
  });
}

}  // namespace

void RefusedPeers::add(kj::Own<kj::AsyncIoStream> caller, FarewellCode code,
                       const std::string& why) {
  if (callers_ >= kMost) return;
  ++callers_;
  auto message = kj::heap<capnp::MallocMessageBuilder>();
  auto farewell = message->initRoot<wire::Frame>().initItems(1)[0].initFarewell();
  farewell.setCode(code);
  farewell.setReason(displayText(why));
  auto& stream = *caller;
  auto& frame = *message;
  auto sent = kj::evalNow([&] { return capnp::writeMessage(stream, frame); }).then([&stream] {
    stream.shutdownWrite();
    return readToEnd(stream);
  });
  tasks_.add(timer_.timeoutAfter(kFarewellTime, kj::mv(sent))
                 .attach(kj::defer([this] { --callers_; }), kj::mv(message), kj::mv(caller)));
}

}  // namespace mpf::router
