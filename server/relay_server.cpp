// SPDX-License-Identifier: MIT
#include "server/relay_server.h"

#include "server/server_core.h"

namespace mpf {

RelayServer::RelayServer(const Backplane& backplane, const std::string& name,
                         const ServerOptions& options, std::uint32_t hops)
    : MessageServer(std::make_unique<ServerCore>(backplane, name, options, hops)) {}

std::shared_ptr<const void> RelayServer::closeAll() {
  struct Pools {
    Connections::Channels channels;
    std::shared_ptr<const FanOutPool> fanOut;
  };
  auto channels = core_->closeAll();
  if (channels.empty()) return nullptr;
  return std::make_shared<Pools>(Pools{std::move(channels), core_->publisher().pool()});
}
void RelayServer::setPolled(bool isPolled) noexcept { core_->setPolled(isPolled); }
Deadline RelayServer::takeBefore() const noexcept { return core_->takeBefore(); }
ReplyResult RelayServer::replyTo(std::uint64_t client, std::uint32_t requestId, Message&& message) {
  const auto own = message.route();
  const auto missed = message.getMissed();
  message.setRoute(core_->connections().routeTo(client, requestId));
  if (missed != 0 && core_->publisher().relay(message, missed) == ReplyResult::sent) {
    message.reset();
    return ReplyResult::sent;
  }
  const auto result = core_->replies().send(message);
  if (message) message.setRoute(own);
  return result;
}
Message RelayServer::receive(MessageRun& run, std::uint64_t& client, std::size_t most) {
  return core_->receiveOrTakeRun(run, client, most);
}
void RelayServer::refuse(std::uint64_t client, const MessageRun& run) noexcept {
  for (std::size_t index = 0; index < run.size(); ++index)
    core_->replies().refuseAbandoned(core_->connections().routeTo(client, run[index].requestId()));
}
std::size_t RelayServer::replyTo(std::uint64_t client, const MessageRun& run,
                                 bool isFirst) noexcept {
  return core_->replies().sendRun(core_->connections().routeTo(client), run, isFirst);
}
bool RelayServer::isUnanswered(std::uint64_t client, std::uint32_t requestId) const noexcept {
  return core_->connections().isUnanswered(client, requestId);
}
std::vector<std::uint32_t> RelayServer::unanswered(std::uint64_t client) const {
  return core_->connections().unanswered(client);
}
BodyBytes RelayServer::allocateBody(std::uint64_t client, std::size_t bytes) {
  return ReplySender::allocate(core_->connections().routeTo(client), bytes);
}

}  // namespace mpf
