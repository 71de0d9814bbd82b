// SPDX-License-Identifier: MIT
#include "router/statistics.h"

#include <cstring>

#include <mpf/clock.h>

#include "shm/segment_name.h"

namespace mpf::router {
namespace {

void zero(layout::RouterLine& line) noexcept {
  for (auto* count :
       {&line.connects, &line.queueSize, &line.inQueue, &line.queueFull, &line.messagesSent,
        &line.messagesReceived, &line.framesSent, &line.framesReceived, &line.bytesSent,
        &line.bytesReceived, &line.roundTripNs, &line.clients, &line.bindings}) {
    count->store(0, std::memory_order_relaxed);
  }
}

}  // namespace

template <std::size_t n>
void PeerRecord::setText(std::array<char, n>& to, const std::string& text) noexcept {
  // A reader reads again when the number is odd, or when it has changed after the read.
  line_.texts.fetch_add(1, std::memory_order_relaxed);
  // PAIR(router-texts): the number before the text that it announces.
  std::atomic_thread_fence(std::memory_order_release);
  const auto bytes = std::min(text.size(), n - 1);
  std::memcpy(to.data(), text.data(), bytes);
  std::memset(to.data() + bytes, 0, n - bytes);
  // PAIR(router-texts): the text before the number that ends it.
  line_.texts.fetch_add(1, std::memory_order_release);
}

// sinceNs does not change while the state alternates between waiting and connecting.
void PeerRecord::setState(layout::RouterLineState state) noexcept {
  using State = layout::RouterLineState;
  const auto was = line_.state.load(std::memory_order_relaxed);
  if (was == State::none || (was == State::connected) != (state == State::connected)) {
    line_.sinceNs.store(static_cast<std::uint64_t>(Clock::nowNs()), std::memory_order_relaxed);
  }
  line_.state.store(state, std::memory_order_relaxed);
}

void PeerRecord::setPeer(const std::string& name, const std::string& program) noexcept {
  setText(line_.peer, name);
  setText(line_.program, program);
}

void PeerRecord::setAddress(const std::string& address) noexcept {
  setText(line_.address, address);
}

void PeerRecord::setLocations(const std::vector<std::int32_t>& locations) {
  std::string text;
  for (const auto location : locations)
    text += (text.empty() ? "" : ", ") + std::to_string(location);
  setText(line_.locations, text);
}

void PeerRecord::setProblem(const std::string& problem) noexcept {
  setText(line_.problem, problem);
}

void PeerRecord::clear() noexcept {
  setState(layout::RouterLineState::none);
  line_.role.store(layout::RouterRole::none, std::memory_order_relaxed);
  setAddress({});
  setPeer({}, {});
  setText(line_.locations, {});
  setProblem({});
  zero(line_);
}

Statistics::Statistics(const Backplane& backplane, const std::string& name)
    : segment_(Segment::create(layout::kRouterBytes, layout::SegmentKind::router, backplane.name(),
                               kReadableByAll)) {
  segment_.lockForLife();
  auto& header = segment_.sharedHeader();
  name.copy(header.name.data(), header.name.size() - 1);
  if (!segment_.tryPublish(
          SegmentName::keyed(backplane.name(), NameKind::router, header.incarnation))) {
    throw std::runtime_error("duplicate incarnation number");
  }
  for (std::size_t row = layout::kRouterLines; row-- != 0;) free_.push_back(row);
}

Statistics::~Statistics() { segments::remove(segment_.name()); }

std::shared_ptr<PeerRecord> Statistics::add(layout::RouterRole role) {
  if (free_.empty()) {
    struct Hidden {
      layout::RouterLine line{};
      PeerRecord record{line};
    };
    auto hidden = std::make_shared<Hidden>();
    return {hidden, &hidden->record};
  }
  const auto row = free_.back();
  free_.pop_back();
  auto& line = segment_.at<layout::RouterLine>(layout::kRouterLinesOffset +
                                               row * sizeof(layout::RouterLine));
  const std::shared_ptr<PeerRecord> record(new PeerRecord(line), [this, row](PeerRecord* old) {
    old->clear();
    delete old;
    free_.push_back(row);
  });
  line.role.store(role, std::memory_order_relaxed);
  record->setState(layout::RouterLineState::waiting);
  return record;
}

}  // namespace mpf::router
