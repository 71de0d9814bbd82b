// SPDX-License-Identifier: MIT
#include "tools/torture/talk.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/format.h>
#include <thread>
#include <utility>

namespace mpf::torture {
namespace {

constexpr std::size_t kOpen = 6;          // most requests without an end
constexpr std::size_t kSeveralSlots = 9;  // elements of an array that needs several slots
constexpr std::size_t kLarge = 300;       // elements of an array that needs a chunk
constexpr unsigned kCancelEvery = 32;
constexpr unsigned kBurstEvery = 16;
constexpr unsigned kRunEvery = 4;
constexpr std::size_t kRun = 20;  // requests that are sent together, as values
constexpr const char* kNoRequest =
    "a reply or fate arrived for a request that had ended or was never sent";
constexpr const char* kReusedId = "a request got the id of another request that is still open";
constexpr std::size_t kBurst = 80;  // open requests whose replies fill the first ring
constexpr auto kPatience = std::chrono::milliseconds(2);  // longest time without room in a burst

}  // namespace

bool holds(std::span<const double> array, std::int32_t value) noexcept {
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (array[i] != elementOf(value, i)) return false;
  }
  return true;
}

Talk::Talk(Dispatcher& dispatcher, World& world, Talked& talked, const std::string& server,
           std::uint32_t seed)
    : world_(world),
      talked_(talked),
      random_(seed),
      client_(dispatcher, [this](const Message& message) { take(message); }) {
  client_.onValues<Int32>(
      [this](std::span<const Int32> values, const Message& first) { takeValues(values, first); });
  client_.bind(server, 0);
}

void Talk::sendSome() {
  if (random_() % kBurstEvery == 0) sendBurst();
  if (random_() % kRunEvery == 0 && !sendRun<Int32>()) return;
  if (random_() % kRunEvery == 0 && !sendRun<OutOfBand>()) return;
  while (open_.size() < kOpen && sendOne()) {
  }
}

// Takes no replies meanwhile, so that the server moves to the second ring. Gives up when the queue
// stays full: the server may be stopped or dead, or belong to this thread.
void Talk::sendBurst() {
  auto patience = Deadline::after(kPatience);
  while (open_.size() < kBurst && client_.isConnected()) {
    if (sendOne()) {
      patience = Deadline::after(kPatience);
    } else if (patience.hasPassed()) {
      return;
    } else {
      std::this_thread::yield();
    }
  }
}

Message Talk::makeArray(std::int32_t value, std::size_t length, bool inPool) {
  auto array =
      inPool ? client_.alloc<Float64Array>(length) : Float64ArrayMessage::allocValue(length);
  array->extra = value;
  for (std::size_t i = 0; i < length; ++i) array.value()[i] = elementOf(value, i);
  return array;
}

Message Talk::makeMessage(std::int32_t value) {
  switch (random_() % 16) {
    case 0:
    case 1:
      return makeArray(value, kSeveralSlots, false);
    case 2:
    case 3:
    case 4:
      return makeArray(value, kLarge, true);
    case 5:
      return makeArray(value, kLarge, false);
    case 6:
      return Int32Message({.cmd = static_cast<std::int32_t>(Request::keep),
                           .address = answerTo(value),
                           .value = value});
    case 7:
      return Int32Message({.cmd = static_cast<std::int32_t>(Request::answerMany),
                           .address = answerTo(value),
                           .value = value});
    default:
      return Int32Message({.cmd = static_cast<std::int32_t>(Request::answer),
                           .address = answerTo(value),
                           .value = value});
  }
}

bool Talk::sendOne() {
  if (!client_.isConnected()) return false;
  const auto value = world_.nextValue();
  const auto deadline = random_() % 16 == 0
                            ? Deadline::after(std::chrono::microseconds(random_() % 300))
                            : Deadline::never();
  auto request = makeMessage(value);
  request.setClientExtra(value);
  std::uint32_t id = 0;
  if (client_.send(std::move(request), deadline, &id) != SendResult::sent) return false;
  if (!open_.emplace(id, value).second) world_.complain(kReusedId);
  if (random_() % kCancelEvery == 0) client_.cancel(id);
  return true;
}

// Returns false if the queue is full, or there is no connection.
template <class T>
bool Talk::sendRun() {
  std::array<T, kRun> values;
  for (auto& value : values) {
    value.cmd = static_cast<std::int32_t>(Request::answer);
    value.value = world_.nextValue();
    value.address = answerTo(value.value);
  }
  std::array<std::uint32_t, kRun> ids{};
  const auto sent = client_.sendMany<T>(values, Deadline::never(), ids);
  for (std::size_t i = 0; i < sent.count; ++i) {
    if (!open_.emplace(ids[i], values[i].value).second) world_.complain(kReusedId);
  }
  return sent.result == SendResult::sent;
}

bool Talk::trySendDie() {
  std::uint32_t id = 0;
  const auto value = world_.nextValue();
  Int32Message request(
      {.cmd = static_cast<std::int32_t>(Request::die), .address = answerTo(value), .value = value});
  if (client_.send(std::move(request), Deadline::never(), &id) != SendResult::sent) return false;
  open_.emplace(id, value);
  return true;
}

void Talk::take(const Message& message) {
  if (const auto* connect = message.tryAs<Connect>()) return takeConnect(*connect);
  const auto found = open_.find(message.route().requestId);
  if (found == open_.end()) return world_.complain(kNoRequest);
  const auto* fate = message.tryAs<RequestFate>();
  if (fate != nullptr && std::exchange(losing_, false)) return;
  const auto value = found->second;
  open_.erase(found);
  if (fate != nullptr) return takeFate(value, fate->fate);
  takeReply(value, message);
}

// Only requests that are sent as values have no marks.
void Talk::takeValues(std::span<const Int32> values, const Message& first) {
  const bool endsRequest = (first.route().flags & kEndsRequest) != 0;
  if (endsRequest && first.getClientExtra() == 0) return takeAnswers(values);
  if (endsRequest) {
    take(first);
    last_ = values.front();
    values = values.subspan(1);
  } else if (first.route().requestId != lastId_) {
    last_ = values.front();
    last_.extra = 0;
  }
  lastId_ = first.route().requestId;
  takeFurther(values);
}

// A server sends all values of one answer before it answers another request. The first value does
// not arrive if the request has had its fate.
void Talk::takeFurther(std::span<const Int32> values) {
  for (const auto& value : values) {
    if (value.cmd != static_cast<std::int32_t>(Request::answerMany)) {
      world_.complain(kNoRequest);
    } else if (value.value != last_.value || value.extra != ++last_.extra) {
      world_.complain(fmt::format("value {} of the answer {} does not follow its former one",
                                  value.extra, value.value));
    }
  }
}

// The values are first replies to requests without marks, which were sent together, in their order.
void Talk::takeAnswers(std::span<const Int32> values) {
  for (const auto& value : values) {
    const auto found = std::ranges::find(open_, answerTo(value.value), &Open::value_type::second);
    if (found == open_.end()) return world_.complain(kNoRequest);
    open_.erase(found);
    ++talked_.replies;
  }
}

void Talk::takeConnect(const Connect& connect) {
  if (connect.status == ConnectStatus::connectYes) talked_.server.store(connect.incarnation);
  if (connect.status != ConnectStatus::connectNo) return;
  if (!open_.empty())
    world_.complain(
        fmt::format("a disconnect was reported before the ends of {} requests", open_.size()));
  ++talked_.disconnects;
}

void Talk::takeFate(std::int32_t value, Fate fate) {
  if (fate == Fate::neverTaken || fate == Fate::expired) world_.noteNeverTaken(value);
}

void Talk::takeNumber(std::int32_t value, std::int32_t answer) {
  if (answer != answerTo(value))
    world_.complain(fmt::format("the reply to {} is {}", value, answer));
}

void Talk::takeReply(std::int32_t value, const Message& reply) {
  ++talked_.replies;
  if (const auto* number = reply.tryAs<Int32>()) {
    takeNumber(value, number->value);
  } else if (const auto* other = reply.tryAs<OutOfBand>()) {
    takeNumber(value, other->value);
  } else if (const auto* array = reply.tryAs<Float64Array>();
             array == nullptr || array->extra != answerTo(value)) {
    world_.complain(fmt::format("the reply to {} is not a reply of its server", value));
  } else if (!holds(reply.valueAs<Float64Array>(), value)) {
    world_.complain(fmt::format("the reply to {} is damaged", value));
  }
}

}  // namespace mpf::torture
