// SPDX-License-Identifier: MIT
#include "router/incoming/far_clients.h"

#include <chrono>
#include <fmt/format.h>
#include <utility>

#include "router/protocol_error.h"

namespace mpf::router {
namespace {

// Batches of messages that the dispatcher runs between two looks at the line and the clock. After a
// single message, the second one finds that there are no more.
constexpr int kBatches = 2;
// The time for the dispatcher before the event loop runs its other tasks.
constexpr std::chrono::milliseconds kDispatcherTurn{1};

}  // namespace

FarClients::FarClients(RouterContext& context, Line& line, PeerRecord& record,
                       FarClient::Events events)
    : context_(context),
      line_(line),
      record_(record),
      events_(std::move(events)),
      timer_(context.timer, [this] { run(); }) {}

void FarClients::open(std::uint32_t number) {
  if (number == 0 || number <= lastClient_)
    throw ProtocolError(
        FarewellCode::PROTOCOL,
        fmt::format("client number {} is not greater than the last one, {}", number, lastClient_));
  if (clients_.size() >= line_.limits().maxClients) {
    throw ProtocolError(FarewellCode::LIMIT, fmt::format("the peer opened more than {} clients",
                                                         line_.limits().maxClients));
  }
  lastClient_ = number;
}

void FarClients::add(const FarClient::Terms& terms, const ServerName& server) {
  if (!shared_) startDispatcher();
  auto client = std::make_unique<FarClient>(*shared_, terms);
  client->bind(server.server, server.location);
  clients_[terms.number] = std::move(client);
  noteClients();
  scheduleRun();
}

void FarClients::startDispatcher() {
  dispatcher_ = std::make_unique<RelayDispatcher>(
      context_.backplane, DispatcherOptions{WaitMode::block, "router " + line_.peer().router});
  readable_ =
      std::make_unique<Readable>(context_.port, dispatcher_->descriptor(), [this] { run(); });
  shared_.emplace(context_.timer, *dispatcher_, line_, record_, heldBytes_, events_);
}

FarClient* FarClients::find(std::uint32_t number) const {
  if (number > lastClient_ || number == 0)
    throw ProtocolError(FarewellCode::PROTOCOL, fmt::format("client {} was never opened", number));
  return tryFind(number);
}

FarClient* FarClients::tryFind(std::uint32_t number) const noexcept {
  if (recent_.second != nullptr && recent_.first == number) return recent_.second;
  const auto found = clients_.find(number);
  if (found == clients_.end()) return nullptr;
  recent_ = {number, found->second.get()};
  return recent_.second;
}

void FarClients::remove(std::uint32_t number) {
  clients_.erase(number);
  noteClients();
}

void FarClients::removeAllOf(std::uint32_t binding) {
  std::erase_if(clients_, [&](const auto& each) { return each.second->binding() == binding; });
  noteClients();
}

void FarClients::dropAllOf(std::uint32_t binding) {
  for (auto each = clients_.begin(); each != clients_.end();) {
    if (each->second->binding() != binding) {
      ++each;
      continue;
    }
    dropped_.push_back(std::move(each->second));
    each = clients_.erase(each);
  }
  noteClients();
}

void FarClients::forEachOf(std::uint32_t binding,
                           const std::function<void(FarClient&)>& act) const {
  for (const auto& [number, client] : clients_) {
    if (client->binding() == binding) act(*client);
  }
}

void FarClients::noteClients() noexcept {
  recent_ = {};
  record_->clients.store(clients_.size(), std::memory_order_relaxed);
}

void FarClients::run() {
  if (!dispatcher_ || !line_.hasRoom()) return;
  const auto end = Deadline::after(kDispatcherTurn);
  bool isDrained = false;
  while (!isDrained && !end.hasPassed() && line_.hasRoom())
    isDrained = dispatcher_->runSome(kBatches);
  dropped_.clear();
  if (!isDrained && line_.hasRoom()) return timer_.setAt(Deadline::after(Nanoseconds(0)));
  scheduleRun();
}

void FarClients::onTraffic() {
  if (dispatcher_) context_.poll(*this);
}

// Runs the dispatcher also when one of its deadlines is due.
void FarClients::scheduleRun() { timer_.setAt(dispatcher_->nextDeadline()); }

}  // namespace mpf::router
