// SPDX-License-Identifier: MIT
#include "crate/capsule/core_file.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <glob.h>
#include <span>

#include <mpf/clock.h>
#include <mpf/file_descriptor.h>

#include "base/printable.h"
#include "base/system_call.h"
#include "base/whole_file.h"
#include "crate/capsule/core_stacks.h"

namespace mpf::crate {

using Tree = nlohmann::ordered_json;

namespace {

Tree problem(std::string text) { return {{"problem", std::move(text)}}; }

std::string firstLine(const std::string& file) {
  const auto text = readWholeFile(file);
  return text.substr(0, text.find('\n'));
}

// The text as a pattern of glob() that only this text matches.
std::string literal(const std::string& text) {
  std::string pattern;
  for (const char letter : text) {
    if (std::string_view("*?[\\").find(letter) != std::string_view::npos) pattern += '\\';
    pattern += letter;
  }
  return pattern;
}

// The newest core of the process; empty: it has left no core.
std::string findCore(const std::string& pattern, pid_t pid) {
  glob_t found{};
  std::string core;
  std::filesystem::file_time_type newest{};
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    for (const std::string file : std::span(found.gl_pathv, found.gl_pathc)) {
      std::error_code ignored;  // a file that has gone has the oldest time
      const auto written = std::filesystem::last_write_time(file, ignored);
      if (pidOfCore(file) != pid || (!core.empty() && written <= newest)) continue;
      core = file;
      newest = written;
    }
  }
  ::globfree(&found);
  return core;
}

Tree look(const DeadProcess& process) {
  const auto corePattern = firstLine("/proc/sys/kernel/core_pattern");
  const auto usesPid = firstLine("/proc/sys/kernel/core_uses_pid") != "0";
  const auto pattern = corePathPattern(corePattern, usesPid, process);
  if (pattern.empty())
    return problem(
        fmt::format("the kernel hands cores to {}; with systemd, \"coredumpctl info {}\" shows it",
                    corePattern.substr(1), process.pid));
  const auto core = findCore(pattern, process.pid);
  if (core.empty())
    return problem(
        fmt::format("found no core of the process in {}; if its core size limit is 0, raise it "
                    "(ulimit -c unlimited)",
                    pattern));
  Tree tree{{"file", core}};
  tree.update(readCore(core));
  return tree;
}

[[noreturn]] void writeAndExit(int to, const std::function<Tree()>& work) {
  std::string text;
  try {
    text = work().dump(-1, ' ', false, Tree::error_handler_t::replace);
  } catch (const std::exception& error) {
    text = problem(printable(error.what())).dump();
  }
  for (std::size_t at = 0; at < text.size();) {
    const auto written =
        retryInterrupted([&] { return ::write(to, text.data() + at, text.size() - at); });
    if (written < 0) break;
    at += static_cast<std::size_t>(written);
  }
  ::_exit(0);
}

// Reads until the end of file. Returns whether it came before the deadline.
bool tryReadAll(int from, Deadline deadline, std::string& text) {
  std::array<char, 4096> buffer{};
  for (;;) {
    pollfd polled{from, POLLIN, 0};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline.left()).count();
    const auto ready = retryInterrupted([&] { return ::poll(&polled, 1, static_cast<int>(left)); });
    if (ready <= 0) return false;
    const auto got = retryInterrupted([&] { return ::read(from, buffer.data(), buffer.size()); });
    if (got <= 0) return got == 0;
    text.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

// What `work` returns in a child process.
Tree inChild(const std::function<Tree()>& work, std::chrono::milliseconds limit) {
  std::array<int, 2> ends{};
  checkCall(::pipe2(ends.data(), O_CLOEXEC), "pipe2");
  const FileDescriptor output(ends[0]);
  FileDescriptor input(ends[1]);
  const auto child = checkCall(::fork(), "fork");
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    writeAndExit(input.get(), work);
  }
  input.reset();
  std::string text;
  const bool isInTime = tryReadAll(output.get(), Deadline::after(limit), text);
  ::kill(child, SIGKILL);
  retryInterrupted([&] { return ::waitpid(child, nullptr, 0); });
  if (!isInTime) return problem(fmt::format("the core was not read within {} ms", limit.count()));
  auto tree = Tree::parse(text, nullptr, false);
  return tree.is_object() ? tree : problem("the process that read the core died");
}

}  // namespace

std::string corePathPattern(const std::string& corePattern, bool usesPid,
                            const DeadProcess& process) {
  if (corePattern.starts_with('|')) return {};
  std::string path = corePattern.starts_with('/') ? "" : literal(process.folder) + '/';
  bool hasPid = false;
  for (std::size_t i = 0; i < corePattern.size(); ++i) {
    if (corePattern[i] != '%') {
      path += corePattern[i];
      continue;
    }
    if (++i == corePattern.size()) break;
    if (corePattern[i] == '%') {
      path += '%';
    } else if (corePattern[i] == 'p') {
      path += std::to_string(process.pid);
      hasPid = true;
    } else {
      path += '*';
    }
  }
  return usesPid && !hasPid ? path + '.' + std::to_string(process.pid) : path;
}

Tree describeCore(const DeadProcess& process, std::chrono::milliseconds limit) {
  return inChild([&] { return look(process); }, limit);
}

}  // namespace mpf::crate
