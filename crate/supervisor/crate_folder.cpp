// SPDX-License-Identifier: MIT
#include "crate/supervisor/crate_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fmt/format.h>
#include <stdexcept>

#include "base/system_call.h"

namespace mpf::crate {
namespace {

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): never changed
  return value != nullptr ? value : "";
}

// Returns whether this process has locked the open file. The lock ends with this process; one of
// flock() or F_OFD_SETLK would be inherited by a child that is about to execute its program, and
// the next supervisor could not start as long as that child lives.
bool tryLock(int file) {
  struct flock range{};
  range.l_type = F_WRLCK;
  if (::fcntl(file, F_SETLK, &range) == 0) return true;
  if (errno != EAGAIN && errno != EACCES) throwSystemError(errno, "fcntl(F_SETLK)", "lock");
  return false;
}

}  // namespace

std::filesystem::path CrateFolder::parent() {
  if (const auto crates = variable("MPF_CRATES"); !crates.empty()) return crates;
  if (::geteuid() == 0) return "/var/lib/mpf/crates";
  const auto state = variable("XDG_STATE_HOME");
  if (!state.empty()) return std::filesystem::path(state) / "mpf/crates";
  const auto home = variable("HOME");
  if (home.empty())
    throw std::runtime_error(
        "cannot choose a folder for the state of the crate: set HOME, XDG_STATE_HOME or "
        "MPF_CRATES");
  return std::filesystem::path(home) / ".local/state/mpf/crates";
}

std::vector<CrateFolder> CrateFolder::all() {
  std::vector<CrateFolder> folders;
  std::error_code failure, gone;
  const auto path = parent();
  for (const auto& entry : std::filesystem::directory_iterator(path, failure)) {
    if (entry.is_directory(gone)) folders.emplace_back(entry.path());
  }
  if (failure && failure.value() != ENOENT)
    throwSystemError(failure.value(), "list", path.string());
  std::ranges::sort(folders, {}, &CrateFolder::path);
  return folders;
}

void CrateFolder::create() const {
  std::filesystem::create_directories(path_.parent_path());
  if (::mkdir(path_.c_str(), 0700) != 0 && errno != EEXIST)
    throwSystemError(errno, "mkdir", path_.string());
}

FileDescriptor CrateFolder::lock() const {
  const auto path = file("lock");
  FileDescriptor opened(
      checkCall(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600), "open", path));
  if (!tryLock(opened.get()))
    throw std::runtime_error(fmt::format(
        "the crate \"{}\" is already running in {}; `mpf ps` shows it, `mpf reload` gives it a "
        "changed file, `mpf stop` ends it",
        name(), path_.string()));
  return opened;
}

std::optional<pid_t> CrateFolder::lockHolder() const {
  const auto path = file("lock");
  const FileDescriptor opened(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!opened && errno == ENOENT) return std::nullopt;
  checkCall(opened.get(), "open", path);
  struct flock range{};
  range.l_type = F_WRLCK;
  checkCall(::fcntl(opened.get(), F_OFD_GETLK, &range), "fcntl(F_OFD_GETLK)", path);
  return range.l_type == F_UNLCK ? std::nullopt : std::optional(range.l_pid);
}

}  // namespace mpf::crate
