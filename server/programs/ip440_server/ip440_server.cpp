// SPDX-License-Identifier: MIT
#include "server/programs/ip440_server/ip440_server.h"

#include "server/programs/hardware/bits_request.h"
#include "server/programs/hardware/other_types.h"

namespace mpf {

Ip440Server::Ip440Server(MessageServer& server, Ip440& inputs, const ServerLog& log)
    : inputs_(inputs), log_(log), faults_(server, log) {
  server.on<Int32>([this](Int32& request) { handle(request); });
  answerOtherTypes<Int32>(server, [this](MessageType type) {
    log_->debug("a request of type {}: status -1", toString(type));
  });
}

void Ip440Server::handle(Int32& shared) {
  auto request = shared;  // a copy: the client can write to the request while we work
  request.status = tryAnswer(request) ? 0 : -1;
  shared = request;
}

bool Ip440Server::tryAnswer(Int32& request) {
  if (!isReadRequest(request.cmd)) {
    log_->debug("unknown cmd {}: status -1", request.cmd);
    return false;
  }
  const auto bits = inputs_.tryRead();
  if (!bits) {
    faults_.fault("the module does not respond, or another module is in its site");
    return false;
  }
  faults_.success();
  return tryAnswerBits(request, request.cmd, *bits);
}

}  // namespace mpf
