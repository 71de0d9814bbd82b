// SPDX-License-Identifier: MIT
// CrateFolder: the folder in which the supervisor of a crate keeps what must survive it.
//
//   lock           held by the supervisor that runs
//   control        socket of mpf ps, mpf stop, ...
//   state.json     the processes that were started
//   NAME.log       stdout and stderr of a process
//   wires          connects the device models of several processes
//   capsules/      crash reports of processes
//
// The folder is $MPF_CRATES/NAME if that variable is set; for root /var/lib/mpf/crates/NAME;
// otherwise $XDG_STATE_HOME/mpf/crates/NAME, where the default is ~/.local/state.
//
// Threads  one.
// Crash    the lock ends with the process that holds it.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <mpf/file_descriptor.h>

namespace mpf::crate {

class CrateFolder {
 public:
  explicit CrateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  // The folder that holds the folders of all crates of this user.
  [[nodiscard]] static std::filesystem::path parent();
  // The folder of a crate; it need not exist.
  [[nodiscard]] static CrateFolder of(const std::string& crate) {
    return CrateFolder(parent() / crate);
  }
  // Of all crates of this user.
  //   throws  std::system_error when the parent folder exists and cannot be read
  [[nodiscard]] static std::vector<CrateFolder> all();

  // Creates the folder, with access for this user only.
  //   throws  std::system_error
  void create() const;
  // Locks the folder for this process, for as long as the descriptor is open, and the process calls
  // neither lock() nor isLocked() again: closing any descriptor of the file unlocks it.
  //   throws  std::runtime_error when another supervisor holds the lock
  [[nodiscard]] FileDescriptor lock() const;
  // Whether another process holds the lock.
  //   throws  std::system_error when this user may not see it
  [[nodiscard]] bool isLocked() const { return lockHolder().has_value(); }
  // The process that holds the lock; 0 or below if this one does not see it.
  [[nodiscard]] std::optional<pid_t> lockHolder() const;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  [[nodiscard]] std::string name() const { return path_.filename().string(); }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] std::string log(const std::string& process) const { return file(process + ".log"); }

 private:
  std::filesystem::path path_;
};

}  // namespace mpf::crate
