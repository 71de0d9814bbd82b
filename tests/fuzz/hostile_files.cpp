// SPDX-License-Identifier: MIT
#include "tests/fuzz/hostile_files.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <iostream>
#include <string_view>

#include "base/system_call.h"
#include "shm/segment.h"
#include "tests/support/usage.h"

namespace mpf::test {
namespace {

constexpr std::uint64_t kCheckEvery = 1024;  // inputs; a check takes as long as tens of inputs

std::vector<std::string> sortedNames(const Backplane& backplane) {
  auto names = backplane.segmentNames();
  std::ranges::sort(names);
  return names;
}

// The number of descriptors and mappings of segments in this process. Others are not counted,
// because the sanitizer has some of its own.
std::size_t segmentsInUse() {
  std::size_t used = Usage::of(::getpid()).segments;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;  // for the descriptor of the directory itself
    used += std::filesystem::read_symlink(entry, gone).string().starts_with("/dev/shm") ? 1 : 0;
  }
  return used;
}

std::vector<std::byte> contentOf(int file) {
  struct stat status{};
  checkCall(::fstat(file, &status), "look at a file");
  std::vector<std::byte> content(static_cast<std::size_t>(status.st_size));
  checkCall(::pread(file, content.data(), content.size(), 0), "read a file");
  return content;
}

}  // namespace

// Removes the backplanes of crashed runs. The files of a run that is still active may have any
// content, even an owner that is dead, so the process id in the name decides.
Backplane fuzzBackplane() {
  constexpr std::string_view kPrefix = "fuzz-";
  for (const auto& name : Backplane::names()) {
    if (!name.starts_with(kPrefix)) continue;
    const auto run = static_cast<pid_t>(std::atol(name.c_str() + kPrefix.size()));
    if (::kill(run, 0) != 0 && errno == ESRCH) Backplane::attach(name);
  }
  return Backplane::attach(
      fmt::format("{}{}-{:x}", kPrefix, ::getpid(), segments::newIncarnation()));
}

HostileFiles::HostileFiles(const Backplane& backplane, const std::vector<std::string>& names)
    : backplane_(backplane), lasting_(names.size()) {
  for (const auto& name : names) add(name);
}

void HostileFiles::add(const std::string& name) {
  FileDescriptor file(
      checkCall(::open(segments::path(name).c_str(), O_RDWR | O_CLOEXEC), "open", name));
  auto content = contentOf(file.get());
  files_.push_back({name, std::move(file), std::move(content)});
}

void HostileFiles::applyInput(std::span<const std::uint8_t> input,
                              const std::function<void(std::uint64_t)>& turn) {
  for (; input.size() >= Operation::kBytes; input = input.subspan(Operation::kBytes)) {
    const Operation operation(input.first<Operation::kBytes>());
    if (operation.what == Operation::What::turn) turn(operation.value);
    else apply(operation);
  }
  turn(0);
}

void HostileFiles::apply(const Operation& operation) {
  constexpr std::array<std::size_t, 4> kWidths{8, 4, 1, 1};
  const auto& [name, file, before] = files_[operation.file % files_.size()];
  const auto width = kWidths[static_cast<std::size_t>(operation.what)];
  const auto offset = static_cast<off_t>(operation.at * width % before.size());
  if (operation.what == Operation::What::cut)
    checkCall(::ftruncate(file.get(), offset), "cut a file");
  else checkCall(::pwrite(file.get(), &operation.value, width, offset), "write to a file");
}

void HostileFiles::restore() {
  files_.erase(files_.begin() + static_cast<std::ptrdiff_t>(lasting_), files_.end());
  for (const auto& file : files_) {
    checkCall(::ftruncate(file.file.get(), static_cast<off_t>(file.before.size())),
              "restore a file");
    checkCall(::pwrite(file.file.get(), file.before.data(), file.before.size(), 0),
              "restore a file");
  }
  if (++runs_ % kCheckEvery == 0) checkNothingLeft();
}

void HostileFiles::checkNothingLeft() {
  const auto used = segmentsInUse();
  auto names = sortedNames(backplane_);
  if (runs_ == kCheckEvery) {
    used_ = used;
    names_ = names;
  }
  if (used == used_ && names == names_) return;
  std::cerr << "after " << runs_ << " inputs: " << used << " segments in use, were " << used_
            << "; " << names.size() << " names, were " << names_.size() << '\n';
  std::abort();
}

}  // namespace mpf::test
