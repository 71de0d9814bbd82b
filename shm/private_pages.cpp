// SPDX-License-Identifier: MIT
#include "shm/private_pages.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include <mpf/file_descriptor.h>

#include "shm/layout.h"

namespace mpf::private_pages {
namespace {

// An entry of /proc/self/pagemap (proc_pid_pagemap(5)).
constexpr std::uint64_t kIsFilePage = std::uint64_t{1} << 61;
constexpr std::uint64_t kIsSwapped = std::uint64_t{1} << 62;  // never set for a page of a file
constexpr std::uint64_t kIsPresent = std::uint64_t{1} << 63;

bool isPrivate(std::uint64_t entry) noexcept {
  return (entry & kIsSwapped) != 0 || (entry & (kIsPresent | kIsFilePage)) == kIsPresent;
}

}  // namespace

bool mayExist(const std::byte* data, std::size_t bytes) noexcept {
  const FileDescriptor map(::open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC));
  if (!map) return true;
  std::array<std::uint64_t, 512> entries{};
  auto page = reinterpret_cast<std::uintptr_t>(data) / layout::kPageBytes;
  const auto end = page + (bytes + layout::kPageBytes - 1) / layout::kPageBytes;
  while (page < end) {
    const auto count = std::min<std::size_t>(entries.size(), end - page);
    const auto size = count * sizeof(entries[0]);
    if (::pread(map.get(), entries.data(), size, static_cast<off_t>(page * sizeof(entries[0]))) !=
        static_cast<ssize_t>(size))
      return true;
    if (std::any_of(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(count),
                    isPrivate))
      return true;
    page += count;
  }
  return false;
}

void drop(std::byte* data, std::size_t bytes) noexcept {
  if (!mayExist(data, bytes) || ::madvise(data, bytes, MADV_DONTNEED) == 0) return;
  ::munlock(data, bytes);  // mlockall() has locked, and so copied, the pages
  ::madvise(data, bytes, MADV_DONTNEED);
}

}  // namespace mpf::private_pages
