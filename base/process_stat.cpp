// SPDX-License-Identifier: MIT
#include "base/process_stat.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>

#include <mpf/file_descriptor.h>

#include "base/number.h"

namespace mpf {

std::optional<ProcessStat> ProcessStat::tryRead(pid_t pid) noexcept {
  std::array<char, 32> path{};
  std::snprintf(path.data(), path.size(), "/proc/%d/stat", pid);
  return tryReadFile(path.data());
}

std::optional<ProcessStat> ProcessStat::tryReadOwn() noexcept {
  return tryReadFile("/proc/self/stat");
}

std::optional<ProcessStat> ProcessStat::tryReadFile(const char* path) noexcept {
  const FileDescriptor file(::open(path, O_RDONLY | O_CLOEXEC));
  ProcessStat stat;
  const auto got = file ? ::read(file.get(), stat.text_.data(), stat.text_.size()) : -1;
  if (got == 0) errno = ESRCH;
  if (got <= 0) return std::nullopt;
  stat.length_ = static_cast<std::size_t>(got);
  return stat;
}

char ProcessStat::state() const noexcept {
  const auto rest = from(3);
  return rest.empty() ? '?' : rest.front();
}

bool ProcessStat::hasEnded() const noexcept { return state() == 'Z' || state() == 'X'; }

std::uint64_t ProcessStat::number(int field) const noexcept {
  auto rest = from(field);
  return tryTakeNumber<std::uint64_t>(rest).value_or(0);
}

// The text from a field on. The program name in field 2 may contain blanks and brackets.
std::string_view ProcessStat::from(int field) const noexcept {
  std::string_view rest(text_.data(), length_);
  rest.remove_prefix(std::min(rest.rfind(')'), rest.size()));
  for (int before = 2; before < field; ++before)
    rest.remove_prefix(std::min(rest.find(' ') + 1, rest.size()));
  return rest;
}

}  // namespace mpf
