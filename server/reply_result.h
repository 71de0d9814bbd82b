// SPDX-License-Identifier: MIT
// replyResult(): what a program is told about a reply, from what the link did with it.
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
