// SPDX-License-Identifier: MIT
#include "tools/torture/world.h"

#include <sys/mman.h>

#include <cerrno>
#include <new>

#include "base/system_call.h"

namespace mpf::torture {

void Board::clear() noexcept {
  for (auto* word : {&rest, &leave, &isAtRest, &isLeaving}) word->store(0);
  for (auto* word : {&open, &incarnation}) word->store(0);
}

void World::complain(std::string_view text) noexcept {
  std::uint32_t none = 0;
  if (!complained_.compare_exchange_strong(none, 1)) return;
  text.copy(complaint_.data(), complaint_.size() - 1);
  complained_.store(2);
}

std::string World::complaint() const {
  return complained_.load() == 2 ? std::string(complaint_.data()) : std::string();
}

std::atomic<std::int32_t>& World::at(Values& values, std::int32_t value) noexcept {
  return values[static_cast<std::uint32_t>(value) % values.size()];
}

// Client and server each write their own entry first and then read the other one, so that the
// second of them sees both.
void World::noteHandled(std::int32_t value) noexcept {
  if (at(handled_, value).exchange(value) == value) complain("a server acted twice on a request");
  if (at(neverTaken_, value).load() == value)
    complain("a server acted on a request that had been reported as never taken");
}

void World::noteNeverTaken(std::int32_t value) noexcept {
  at(neverTaken_, value).store(value);
  if (at(handled_, value).load() == value)
    complain("a request was reported as never taken, but a server had acted on it");
}

SharedWorld::SharedWorld() {
  void* memory =
      ::mmap(nullptr, sizeof(World), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED)
    throwSystemError(errno, "mmap", "memory shared with the test processes");
  world_ = new (memory) World;
}

SharedWorld::~SharedWorld() {
  world_->isOver.store(1);
  ::munmap(world_, sizeof(World));
}

}  // namespace mpf::torture
