// SPDX-License-Identifier: MIT
#include "benchmarks/stage/program.h"

#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <exception>
#include <filesystem>

#include "base/system_call.h"
#include "benchmarks/peers/mpf_peer.h"

namespace mpf::bench {
namespace {

constexpr auto kStopLimit = std::chrono::seconds(5);

}  // namespace

void Program::start(std::vector<std::string> words, const Cpus& cpus,
                    const std::function<void()>& enter) {
  stop();
  said_ =
      FileDescriptor(checkCall(::memfd_create("output of a program", MFD_CLOEXEC), "memfd_create"));
  pid_ = startProgram(std::move(words), [&] {
    ::dup2(said_.get(), STDERR_FILENO);
    ::dup2(said_.get(), STDOUT_FILENO);
    pinTo(cpus);
    raiseDescriptorLimit();
    if (enter) enter();
  });
}

void Program::stop() noexcept try {
  if (hasEnded()) return;
  ::kill(pid_, SIGTERM);
  if (!waitUntil([&] { return hasEnded(); }, kStopLimit)) killProcess(pid_);
  pid_ = 0;
} catch (const std::exception&) {
  killProcess(pid_);
  pid_ = 0;
}

bool Program::hasEnded() noexcept {
  if (pid_ != 0 && bench::hasEnded(pid_)) pid_ = 0;
  return pid_ == 0;
}

// Reads with pread(), because the program shares the position of the file.
std::string Program::said() const {
  std::string text(static_cast<std::size_t>(std::max<off_t>(0, ::lseek(said_.get(), 0, SEEK_CUR))),
                   '\0');
  const auto got = ::pread(said_.get(), text.data(), text.size(), 0);
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return text;
}

std::string Program::lastLine() const {
  auto text = said();
  while (text.ends_with('\n')) text.pop_back();
  return text.substr(text.rfind('\n') + 1);
}

}  // namespace mpf::bench
