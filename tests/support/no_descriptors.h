// SPDX-License-Identifier: MIT
// NoDescriptors: while it exists, this process has no file descriptor left, unless it closes one of
// those that it has.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>

#include <stdexcept>

#include <mpf/file_descriptor.h>

namespace mpf::test {

class NoDescriptors {
 public:
  NoDescriptors() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const FileDescriptor lowestFree(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    const rlimit none{static_cast<rlim_t>(lowestFree.get()), before_.rlim_max};
    if (!lowestFree || ::setrlimit(RLIMIT_NOFILE, &none) != 0)
      throw std::runtime_error("the number of descriptors cannot be limited");
  }
  ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;

 private:
  rlimit before_{};
};

}  // namespace mpf::test
