// SPDX-License-Identifier: MIT
#include "server/programs/log.h"

namespace mpf {

Log::Log(Write write, Level least, Now now) : core_(std::make_shared<Core>()) {
  core_->least = least;
  core_->write = std::move(write);
  core_->now = std::move(now);
}

Log Log::forObject() const {
  auto other = *this;
  const std::scoped_lock guard(core_->lock);
  other.object_ = ++core_->lastObject;
  return other;
}

void Log::setLevel(const std::string& name) const {
  core_->least.store(spdlog::level::from_str(name), std::memory_order_relaxed);
}

void Log::onHeld(std::function<void(std::int64_t)> held) const {
  const std::scoped_lock guard(core_->lock);
  core_->held = std::move(held);
}

void Log::sayText(Level level, const std::source_location& at, std::string text) const {
  auto& core = *core_;
  const std::scoped_lock guard(core.lock);
  const auto dueNs = core.limiter.dueNs();
  const LogLimiter::Kind kind{at.file_name(), at.line(), object_};
  if (core.limiter.admit(kind, level, text, core.now())) return core.write(level, std::move(text));
  if (core.held && core.limiter.dueNs() < dueNs) core.held(core.limiter.dueNs());
}

std::int64_t Log::writeDue() const {
  auto& core = *core_;
  const std::scoped_lock guard(core.lock);
  for (auto& line : core.limiter.takeDue(core.now())) {
    core.write(static_cast<Level>(line.level), std::move(line.text));
  }
  return core.limiter.dueNs();
}

void Log::writeHeld() const {
  auto& core = *core_;
  const std::scoped_lock guard(core.lock);
  for (auto& line : core.limiter.takeAll(core.now())) {
    core.write(static_cast<Level>(line.level), std::move(line.text));
  }
}

}  // namespace mpf
