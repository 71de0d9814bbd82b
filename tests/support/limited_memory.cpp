// SPDX-License-Identifier: MIT
#include "tests/support/limited_memory.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {

void* tryAllocate(std::size_t bytes) noexcept {
  auto& left = mpf::test::allocationsLeft;
  if (left == 0 && mpf::test::isMemoryLimited) {
    ++mpf::test::failedAllocations;
    return nullptr;
  }
  if (left > 0) --left;
  return std::malloc(std::max<std::size_t>(bytes, 1));
}

}  // namespace

void* operator new(std::size_t bytes) {
  if (auto* memory = tryAllocate(bytes)) return memory;
  throw std::bad_alloc();
}
void* operator new(std::size_t bytes, const std::nothrow_t& /*tag*/) noexcept {
  return tryAllocate(bytes);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*bytes*/) noexcept { std::free(memory); }

namespace mpf::test {

LimitedMemory::LimitedMemory(int allocations) noexcept {
  allocationsLeft = allocations;
  isMemoryLimited = true;
}
LimitedMemory::~LimitedMemory() { allocationsLeft = kUnlimited; }

}  // namespace mpf::test
