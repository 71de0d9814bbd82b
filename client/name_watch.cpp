// SPDX-License-Identifier: MIT
#include "client/name_watch.h"

#include "shm/segment_name.h"

namespace mpf {

NameWatch::~NameWatch() {
  if (!endpoint_.forkGuard().isInherited()) stop();
}

void NameWatch::start() {
  if (isRunning()) return;
  token_ =
      endpoint_.backplane().watcher().watchNames(NameKind::serverWindow, [this] { noteChange(); });
  noteChange();
}

void NameWatch::stop() {
  if (!isRunning()) return;
  endpoint_.backplane().watcher().forget(token_);
  token_ = 0;
}

void NameWatch::noteChange() noexcept {
  hasChanged_.store(true, std::memory_order_relaxed);
  endpoint_.interrupt();
}

}  // namespace mpf
