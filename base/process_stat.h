// SPDX-License-Identifier: MIT
// ProcessStat: what /proc/<pid>/stat says about a process. proc(5) lists the fields.
//
// Threads  any; it allocates nothing.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace mpf {

// Whether a state of proc(5) is that of a process that a signal or a debugger has stopped.
[[nodiscard]] constexpr bool isStopped(char processState) noexcept {
  return processState == 'T' || processState == 't';
}

class ProcessStat {
 public:
  // Fields of proc(5).
  static constexpr int kUserTicks = 14;
  static constexpr int kSystemTicks = 15;
  static constexpr int kStartTicks = 22;

  // nullopt, and the reason in errno: there is no such process (ENOENT, ESRCH), /proc hides it
  // (ENOENT, EPERM), or no descriptor is free, for example.
  static std::optional<ProcessStat> tryRead(pid_t pid) noexcept;
  // This process, also where /proc belongs to another pid namespace.
  static std::optional<ProcessStat> tryReadOwn() noexcept;

  // Its letter in proc(5); '?' when the file does not have it.
  [[nodiscard]] char state() const noexcept;
  // A zombie, or a process that is being removed.
  [[nodiscard]] bool hasEnded() const noexcept;
  // A field from 4 on; 0 when the file does not have it.
  [[nodiscard]] std::uint64_t number(int field) const noexcept;

 private:
  static std::optional<ProcessStat> tryReadFile(const char* path) noexcept;
  [[nodiscard]] std::string_view from(int field) const noexcept;

  std::array<char, 1024> text_{};
  std::size_t length_ = 0;
};

}  // namespace mpf
