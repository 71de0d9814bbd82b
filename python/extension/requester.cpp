// SPDX-License-Identifier: MIT
#include "python/extension/requester.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "python/extension/options.h"

namespace mpf::python {
namespace {

constexpr int kLastLooks = 32;  // calls of runOnce() for a request whose time has passed
// Replies in the memory of the connection that may wait for the program; further ones are copied.
// This memory has few chunks: see ServerOptions::queueSize.
constexpr int kMostBorrowed = 32;

bool endsRequest(const Message& message) noexcept {
  return (message.route().flags & kEndsRequest) != 0;
}

}  // namespace

Requester::Requester(const Backplane& backplane, const std::string& server, std::int32_t location,
                     WaitMode waitMode)
    : dispatcher_(backplane, {waitMode, "python"}),
      client_(dispatcher_, [this](Message&& message) { take(std::move(message)); }) {
  client_.bind(server, location);
}

Requester::~Requester() = default;

void Requester::close() {
  const std::lock_guard lock(mutex_);
  isClosed_ = true;
  exchanges_.forEach([](Exchange& exchange) {
    exchange.isDisconnected = true;
    if (!exchange.hasEnded()) exchange.fate = Fate::cancelled;
  });
  exchanges_.clear();
  changed_.notify_all();
  dispatcher_.interrupt();
}

// ---- messages that arrive, on the thread that runs the dispatcher

void Requester::take(Message&& message) {
  const std::lock_guard lock(mutex_);
  if (isClosed_) return;  // the exchanges may not exist any more
  if (const auto* connect = message.tryAs<Connect>()) {
    takeConnect(*connect);
  } else if (auto* const exchange =
                 exchanges_.tryFind(message.route().requestId, endsRequest(message))) {
    takeAnswer(*exchange, std::move(message));
  }
  changed_.notify_all();
}

void Requester::takeAnswer(Exchange& exchange, Message&& message) {
  exchange.missed += message.getMissed();
  if (const auto* fate = message.tryAs<RequestFate>()) {
    exchange.fate = fate->fate;
  } else if (endsRequest(message)) {
    keepReply(exchange, std::move(message));
  } else if (exchange.limit > 0) {
    if (exchange.further.size() == exchange.limit) {
      exchange.further.pop_front();
      ++exchange.missed;
    }
    exchange.further.push_back(std::move(message));
  }
  if (keepsEvents_) events_.push_back(exchange.id);
}

void Requester::keepReply(Exchange& exchange, Message&& reply) {
  exchange.isBorrowed = !reply.isInline();
  if (exchange.isBorrowed && borrowed_ >= kMostBorrowed) {
    try {
      reply = reply.duplicate();
      exchange.isBorrowed = false;
      // NOLINTNEXTLINE(bugprone-empty-catch): the reply stays where it is
    } catch (const std::bad_alloc&) {
    }
  }
  if (exchange.isBorrowed) ++borrowed_;
  exchange.reply = std::move(reply);
  exchange.hasReply = true;
}

void Requester::freeReply(Exchange& exchange) noexcept {
  if (exchange.isBorrowed) --borrowed_;
  exchange.isBorrowed = false;
}

void Requester::takeConnect(const Connect& connect) {
  if (connect.status == ConnectStatus::connectNo) {
    // Those that have not ended are sent again to the next server.
    exchanges_.forEach([](Exchange& exchange) {
      exchange.isDisconnected = exchange.isDisconnected || exchange.hasEnded();
    });
  }
  if (keepsEvents_) events_.push_back(0);
}

// ---- waiting

template <class Run>
void Requester::runDispatcher(std::unique_lock<std::mutex>& lock, const Run& run) {
  isRunning_ = true;
  lock.unlock();
  try {
    run();
  } catch (...) {
    lock.lock();
    isRunning_ = false;
    changed_.notify_all();
    throw;
  }
  lock.lock();
  isRunning_ = false;
  changed_.notify_all();
}

template <class Done>
bool Requester::wait(const Done& isDone, Deadline deadline, const IsInterrupted& isInterrupted) {
  auto look = Deadline::after(kLookForSignals);
  std::unique_lock lock(mutex_);
  while (!isDone()) {
    if (isClosed_ || deadline.hasPassed()) return false;
    if (look.hasPassed()) {
      lock.unlock();
      if (isInterrupted()) return false;
      lock.lock();
      look = Deadline::after(kLookForSignals);
      continue;  // it may be done now
    }
    const auto end = std::min(deadline, look);
    if (isRunning_ || turns_ > 0) changed_.wait_for(lock, end.left());
    else runDispatcher(lock, [&] { dispatcher_.runOnce(end); });
  }
  return true;
}

bool Requester::connect(Deadline deadline, const IsInterrupted& isInterrupted) {
  if (client_.isConnected()) return true;
  return wait([this] { return client_.isConnected(); }, deadline, isInterrupted);
}

void Requester::waitForEnd(Exchange& exchange, Deadline deadline,
                           const IsInterrupted& isInterrupted) {
  const auto hasEnded = [&exchange] { return exchange.hasEnded(); };
  if (wait(hasEnded, deadline, isInterrupted)) return;
  std::unique_lock lock(mutex_);
  lookOnceMore(lock, exchange);
  if (exchange.hasEnded()) return;
  lock.unlock();
  client_.cancel(exchange.id);
  lock.lock();
  if (!exchange.hasEnded() || exchange.fate == Fate::cancelled)
    exchange.fate = deadline.hasPassed() && !isClosed_ ? Fate::outcomeUnknown : Fate::cancelled;
}

// A thread that runs the dispatcher at once; the thread that ran it waits until the turn ends.
class Requester::Turn {
 public:
  template <class Done>
  Turn(Requester& of, std::unique_lock<std::mutex>& lock, const Done& isDone) : self_(of) {
    ++self_.turns_;
    if (self_.isRunning_) self_.dispatcher_.interrupt();
    self_.changed_.wait(lock, [&] { return !self_.isRunning_ || isDone(); });
  }
  ~Turn() {
    --self_.turns_;
    self_.changed_.notify_all();
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  Requester& self_;
};

// Delivers `expired` if the server has not taken the request.
void Requester::lookOnceMore(std::unique_lock<std::mutex>& lock, const Exchange& exchange) {
  const Turn turn(*this, lock, [&] { return exchange.hasEnded(); });
  // Messages come before requests that expire, and an interrupt may end one call.
  for (int looks = 0; looks < kLastLooks && !exchange.hasEnded(); ++looks)
    runDispatcher(lock, [this] { dispatcher_.runOnce(Deadline::atNs(0)); });
}

void Requester::takeArrived() {
  std::unique_lock lock(mutex_);
  if (keepsEvents_ || isClosed_) return;
  const Turn turn(*this, lock, [] { return false; });
  runDispatcher(lock, [this] { dispatcher_.runPending(); });
}

Message Requester::waitForFurther(Exchange& exchange, Deadline deadline,
                                  const IsInterrupted& isInterrupted) {
  const auto hasSome = [&] { return !exchange.further.empty() || exchange.isDisconnected; };
  wait(hasSome, deadline, isInterrupted);
  return takeFurther(exchange);
}

Message Requester::takeFurther(Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  if (exchange.further.empty()) return {};
  auto message = std::move(exchange.further.front());
  exchange.further.pop_front();
  return message;
}

Message Requester::takeReply(Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  freeReply(exchange);
  return std::move(exchange.reply);
}

// ---- requests

SendResult Requester::send(Message&& message, Exchange& exchange, Deadline takeBefore,
                           Retry retry) {
  // The lock is held until the request is in the table: its reply may arrive at once.
  const std::lock_guard lock(mutex_);
  const auto result = client_.send(std::move(message), takeBefore, &exchange.id, retry);
  if (result == SendResult::sent) exchanges_.add(exchange);
  return result;
}

SentMany Requester::sendMany(std::span<Message> messages, std::span<Exchange* const> exchanges,
                             Deadline takeBefore) {
  std::vector<std::uint32_t> ids(messages.size());
  const std::lock_guard lock(mutex_);  // as in send()
  const auto sent = client_.sendMany(messages, takeBefore, ids);
  for (std::size_t i = 0; i < sent.count; ++i) {
    exchanges[i]->id = ids[i];
    exchanges_.add(*exchanges[i]);
  }
  return sent;
}

bool Requester::hasEnded(const Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  return exchange.hasEnded();
}

bool Requester::isDisconnected(const Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  return exchange.isDisconnected;
}

std::uint64_t Requester::missed(const Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  return exchange.missed;
}

void Requester::cancel(Exchange& exchange) { client_.cancel(exchange.id); }

void Requester::forget(Exchange& exchange) {
  const std::lock_guard lock(mutex_);
  exchanges_.remove(exchange);
  freeReply(exchange);
  exchange.isDisconnected = true;
  if (exchange.hasEnded()) return;
  exchange.fate = Fate::cancelled;
  changed_.notify_all();
}

// ---- event loops

std::vector<std::uint32_t> Requester::runPending() {
  {
    const std::lock_guard lock(mutex_);
    keepsEvents_ = true;
  }
  dispatcher_.runPending();
  const std::lock_guard lock(mutex_);
  return std::exchange(events_, {});
}

}  // namespace mpf::python
