// SPDX-License-Identifier: MIT
// replyResult(): converts the result of a link into the ReplyResult of a program.
#pragma once

#include <mpf/message_server.h>

#include "shm/link.h"

namespace mpf {

[[nodiscard]] inline ReplyResult replyResult(LinkSend sent) noexcept {
  switch (sent) {
    case LinkSend::full:
      return ReplyResult::queueFull;
    case LinkSend::tooLarge:
      return ReplyResult::tooLarge;
    case LinkSend::noMemory:
      return ReplyResult::noMemory;
    case LinkSend::sent:
    case LinkSend::sentInPlace:
      break;
  }
  return ReplyResult::sent;
}

}  // namespace mpf
