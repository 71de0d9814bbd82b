// SPDX-License-Identifier: MIT
#include "base/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf {

std::string readWholeFile(const std::string& file) {
  const FileDescriptor opened(checkCall(::open(file.c_str(), O_RDONLY | O_CLOEXEC), "open", file));
  std::string text;
  std::array<char, 4096> bytes{};
  for (;;) {
    const auto length = checkCall(
        retryInterrupted([&] { return ::read(opened.get(), bytes.data(), bytes.size()); }), "read",
        file);
    if (length == 0) return text;
    text.append(bytes.data(), static_cast<std::size_t>(length));
  }
}

EndOfFile readEndOfFile(const std::string& file, std::size_t limit) {
  const FileDescriptor opened(
      checkCall(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK), "open", file));
  struct stat status{};
  checkCall(::fstat(opened.get(), &status), "look at", file);
  const auto size = static_cast<std::uint64_t>(std::max<off_t>(0, status.st_size));
  EndOfFile end;
  end.text.resize(std::min<std::uint64_t>(size, limit));
  end.leftOutBytes = size - end.text.size();
  const auto got = checkCall(
      ::pread(opened.get(), end.text.data(), end.text.size(), static_cast<off_t>(end.leftOutBytes)),
      "read", file);
  end.text.resize(static_cast<std::size_t>(got));
  return end;
}

}  // namespace mpf
