// SPDX-License-Identifier: MIT
#include "client/relay_client.h"

#include "client/binding.h"

namespace mpf {

SendResult RelayClient::sendAs(std::uint32_t requestId, Message&& message,
                               Deadline takeBefore) noexcept {
  if (isInherited()) return SendResult::notConnected;
  return binding_->sendAs(requestId, message, takeBefore);
}

std::size_t RelayClient::sendAs(const MessageRun& run) noexcept {
  return isInherited() ? 0 : binding_->sendAs(run);
}

void RelayClient::setRunReceiver(RunReceiver& receiver) { binding_->setRunReceiver(receiver); }

bool RelayClient::lacksResources() const noexcept { return binding_->lacksResources(); }

void RelayClient::pause() { binding_->pause(); }
void RelayClient::resume() { binding_->resume(); }

}  // namespace mpf
