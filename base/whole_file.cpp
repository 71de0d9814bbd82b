// SPDX-License-Identifier: MIT
#include "base/whole_file.h"

#include <fcntl.h>
#include <unistd.h>

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

}  // namespace mpf
