// SPDX-License-Identifier: MIT
#include "tools/torture/echo.h"

#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <fmt/format.h>
#include <tuple>
#include <type_traits>
#include <utility>

#include "tools/torture/talk.h"

namespace mpf::torture {
namespace {

constexpr auto kBoardInterval = std::chrono::milliseconds(2);  // between two reads of the board
constexpr int kMostAtOnce = 100;  // requests that are handled between two reads of the board
constexpr std::uint32_t kNewEvery = 3;  // every third array gets a new message as its reply
constexpr std::uint32_t kPublishEvery = 2;  // every second of these is published
constexpr std::size_t kValues = 24;  // of an answer with many values: several runs

}  // namespace

Echo::Echo(const Backplane& backplane, const std::string& name, World& world, WaitMode waitMode)
    : world_(world),
      server_(backplane, name,
              {.location = 0, .queueSize = 40, .waitMode = waitMode, .maxBorrowed = 64}) {
  const auto complain = [this]<class T>(std::type_identity<T>) {
    if constexpr (!detail::kIsNotification<T>)
      server_.on<T>([this](MessageOf<T>&&) {
        world_.complain("a server received a message of a type that no client sends");
      });
  };
  [&]<class... T>(std::type_identity<std::tuple<T...>>) {
    (complain(std::type_identity<T>()), ...);
  }(std::type_identity<MessageTypes>{});
  server_.on<Int32>([this](Int32Message&& request) { answer(std::move(request)); });
  server_.on<Float64Array>([this](Float64ArrayMessage&& request) { answer(std::move(request)); });
  server_.on<OutOfBand>([this](std::span<OutOfBand> requests) { answer(requests); });
}

void Echo::run(const Board& board, bool byDescriptor) {
  pollfd descriptor{byDescriptor ? server_.descriptor() : -1, POLLIN, 0};
  while (board.leave.load() == 0) {
    const bool isReady = byDescriptor
                             ? ::poll(&descriptor, 1, static_cast<int>(kBoardInterval.count())) > 0
                             : server_.waitForMessage(Deadline::after(kBoardInterval));
    // Without a later request the kept one is never answered: dropping it refuses it.
    if (!isReady) kept_.reset();
    for (auto most = kMostAtOnce; most != 0 && server_.handleOne(); --most) continue;
  }
}

void Echo::handleAll() {
  while (server_.handleOne()) {
  }
}

// Records that a request was received. Returns false when it differs from what was sent.
bool Echo::note(std::int32_t value, bool isSound) {
  if (!isSound) world_.complain(fmt::format("request {} is damaged", value));
  world_.noteHandled(value);
  return isSound;
}

void Echo::answer(std::span<OutOfBand> requests) {
  for (auto& request : requests) {
    static_cast<void>(note(request.value, request.address == answerTo(request.value)));
    request.value = answerTo(request.value);
  }
}

void Echo::answer(Int32Message&& request) {
  if (!note(request->value, request->address == answerTo(request->value))) return;
  if (request->cmd == static_cast<std::int32_t>(Request::die)) ::raise(SIGKILL);
  request->value = answerTo(request->value);
  if (request->cmd == static_cast<std::int32_t>(Request::answerMany)) return answerMany(request);
  Message now = std::move(request);
  if (now.tryAs<Int32>()->cmd == static_cast<std::int32_t>(Request::keep)) std::swap(now, kept_);
  if (now) send(std::move(now));
}

// The further values are dropped where the client's ring is full.
void Echo::answerMany(const Int32Message& answer) {
  std::array<Int32, kValues> values;
  for (std::size_t i = 0; i < kValues; ++i) {
    values[i] = *answer;
    values[i].extra = static_cast<std::int32_t>(i);
  }
  const auto sent = server_.replyMany<Int32>(answer, values);
  if (sent.count == 0) check(sent.result);
}

void Echo::answer(Float64ArrayMessage&& request) {
  const auto value = request->extra;
  if (!note(value, holds(request.value(), value))) return;
  if (++arrays_ % kNewEvery != 0) {
    request->extra = answerTo(value);
    return send(std::move(request));
  }
  const bool isShared = arrays_ / kNewEvery % kPublishEvery == 0;
  auto reply = isShared ? server_.allocShared<Float64Array>(request.getLength())
                        : server_.allocReplyMessage<Float64Array>(request, request.getLength());
  reply->extra = answerTo(value);
  std::ranges::copy(request.value(), reply.value().begin());
  if (isShared) check(server_.publish(reply, request));
  else send(std::move(reply));
}

void Echo::send(Message&& reply) { check(server_.reply(std::move(reply))); }

void Echo::check(ReplyResult result) {
  if (result != ReplyResult::sent && result != ReplyResult::clientGone) {
    world_.complain(fmt::format("a first reply could not be sent: {}", toString(result)));
  }
}

}  // namespace mpf::torture
