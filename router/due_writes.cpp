// SPDX-License-Identifier: MIT
#include "router/due_writes.h"

#include <algorithm>
#include <utility>

#include "router/after_ready_tasks.h"

namespace mpf::router {

void DueWrites::add(DueWriter& writer) {
  due_.push_back(&writer);
  if (!isDriven_) runSoon();
}

void DueWrites::runSoon() {
  if (std::exchange(hasTask_, true)) return;
  tasks_.add(afterReadyTasks(timer_).then([this] {
    hasTask_ = false;
    run();
  }));
}

void DueWrites::remove(DueWriter& writer) noexcept {
  std::erase(due_, &writer);
  std::ranges::replace(running_, &writer, nullptr);
}

void DueWrites::run() {
  if (!running_.empty()) return;  // called by a writeDue()
  running_.swap(due_);
  for (auto& writer : running_)
    if (writer != nullptr) writer->writeDue();
  running_.clear();
}

void DueWrites::setDriven(bool isDriven) {
  isDriven_ = isDriven;
  if (!isDriven && !due_.empty()) runSoon();
}

}  // namespace mpf::router
