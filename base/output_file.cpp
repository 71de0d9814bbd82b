// SPDX-License-Identifier: MIT
#include "base/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

#include "base/system_call.h"

namespace mpf {

OutputFile::OutputFile(std::string path, mode_t mode)
    : path_(std::move(path)),
      file_(checkCall(::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, mode), "open", path_)) {
  // A device that accepts no data, such as /dev/full, also refuses a write of zero bytes.
  checkCall(::write(file_.get(), "", 0), "write", path_);
}

void OutputFile::write(std::string_view bytes) {
  struct stat status{};
  if (!std::exchange(isBegun_, true) && ::fstat(file_.get(), &status) == 0 &&
      S_ISREG(status.st_mode)) {
    checkCall(::ftruncate(file_.get(), 0), "truncate", path_);
  }
  while (!bytes.empty()) {
    const auto written =
        retryInterrupted([&] { return ::write(file_.get(), bytes.data(), bytes.size()); });
    bytes.remove_prefix(static_cast<std::size_t>(checkCall(written, "write", path_)));
  }
}

void OutputFile::close() {
  write({});  // truncates the file if nothing has been written
  // Some file systems report a full disk only at close().
  checkCall(::close(file_.release()), "write", path_);
}

void replaceFile(const std::string& path, std::string_view text, mode_t mode) {
  const auto fresh = path + ".new";
  try {
    OutputFile file(fresh, mode);
    file.write(text);
    file.close();
    checkCall(std::rename(fresh.c_str(), path.c_str()), "rename", path);
  } catch (...) {
    ::unlink(fresh.c_str());
    throw;
  }
}

}  // namespace mpf
