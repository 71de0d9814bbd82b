// SPDX-License-Identifier: MIT
#include "tools/tap/ghost_server.h"

#include <utility>

#include "base/saturating.h"
#include "tools/tap/pace.h"

namespace mpf::tools {
namespace {

constexpr std::int64_t kRetryNs = 1'000'000;  // until the next attempt to send to a full queue

}  // namespace

void GhostServer::run() {
  while (!stopped_) {
    server_.waitForMessage(due_.empty() ? Deadline::never() : Deadline::atNs(due_.begin()->first));
    while (auto request = server_.receive()) take(std::move(request));
    sendDue();
  }
}

void GhostServer::take(Message&& request) {
  ++counts_.requests;
  const auto found = script_.next(request);
  if (found.exchange == nullptr) {
    ++counts_.unknown;
    return server_.refuse(std::move(request));
  }
  if (found.match == GhostScript::Match::similar) ++counts_.similar;
  if (!found.exchange->replies.empty())
    return schedule({std::move(request), found.exchange, Clock::nowNs()});
  ++counts_.silent;
  forgetGone();
  silent_.push_back(std::move(request));
}

void GhostServer::schedule(Answering&& answering) {
  const auto at = dueNs(answering);
  due_.emplace(at, std::move(answering));
}

std::int64_t GhostServer::dueNs(const Answering& answering) const {
  if (speed_ <= 0) return answering.beginNs;
  const auto after = answering.exchange->replies[answering.next].after;
  return answering.beginNs + replayedNs(after.count(), speed_);
}

void GhostServer::sendDue() {
  while (!due_.empty() && due_.begin()->first <= Clock::nowNs()) {
    auto node = due_.extract(due_.begin());
    auto& answering = node.mapped();
    if (!trySend(answering)) {
      due_.emplace(Clock::nowNs() + kRetryNs, std::move(answering));
    } else if (++answering.next < answering.exchange->replies.size() &&
               server_.isClientConnected(answering.request)) {
      schedule(std::move(answering));
    }
  }
}

bool GhostServer::trySend(Answering& answering) {
  const auto& recorded = answering.exchange->replies[answering.next];
  if (recorded.message.getType() == MessageType::requestFate) {
    server_.refuse(std::move(answering.request));
    return true;
  }
  auto reply = recorded.message.duplicate();
  reply.setClientType(answering.request.getClientType());
  reply.setClientExtra(answering.request.getClientExtra());
  if (reply.getTimeStampNs() != 0)
    reply.setTimeStampNs(saturatingSum(reply.getTimeStampNs(),
                                       saturatingDifference(Clock::wallNs(), recorded.atNs)));
  auto route = answering.request.route();
  route.keeper = nullptr;
  reply.setRoute(route);
  const auto result = server_.reply(std::move(reply));
  if (result == ReplyResult::queueFull) return false;
  if (result == ReplyResult::sent) ++counts_.replies;
  else answering.next = answering.exchange->replies.size() - 1;  // no memory: it ends as refused
  return true;
}

void GhostServer::forgetGone() {
  std::erase_if(silent_,
                [&](const Message& request) { return !server_.isClientConnected(request); });
}

}  // namespace mpf::tools
