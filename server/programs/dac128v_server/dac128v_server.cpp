// SPDX-License-Identifier: MIT
#include "server/programs/dac128v_server/dac128v_server.h"

#include <utility>

#include "server/programs/hardware/other_types.h"

namespace mpf {

Dac128vServer::Dac128vServer(MessageServer& server, Dac128v& dac, const ServerLog& log)
    : dac_(dac), log_(log), faults_(server, log) {
  server.on<Int32>([this](Int32& request) { handle(request); });
  answerOtherTypes<Int32>(server, [this](MessageType type) {
    log_->debug("a request of type {}: status -1", toString(type));
  });
}

void Dac128vServer::handle(Int32& request) {
  if (!std::exchange(isAsked_, true)) log_->info("first request");
  const auto channel = request.address;  // once: the client can write to the request while we work
  const auto code = request.value;
  const auto status = dac_.tryWrite(channel, code);
  request.status = status == Dac128vStatus::success ? 0 : -1;
  if (const auto now = dac_.restorations(); std::exchange(restorations_, now) != now)
    faults_.alarm(
        "the module had lost its outputs, by a reset or a power cycle: they have been restored");
  if (status == Dac128vStatus::success) return faults_.success();
  if (isFault(status)) return faults_.fault(toString(status));
  log_->debug("channel {}, code {}: {}", channel, code, toString(status));
}

}  // namespace mpf
