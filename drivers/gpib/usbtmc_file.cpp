// SPDX-License-Identifier: MIT
#include "drivers/gpib/usbtmc_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf {
namespace {

template <class Result>
Result orError(Result result) noexcept {
  return result < 0 ? static_cast<Result>(-errno) : result;
}

class DeviceFile final : public UsbtmcFile {
 public:
  explicit DeviceFile(std::string path) : path_(std::move(path)) {}

  int open() override {
    file_.reset(::open(path_.c_str(), O_RDWR | O_CLOEXEC));
    return file_ ? 0 : -errno;
  }
  void close() noexcept override { file_.reset(); }
  std::int64_t write(std::span<const std::uint8_t> bytes) override {
    return orError(
        retryInterrupted([&] { return ::write(file_.get(), bytes.data(), bytes.size()); }));
  }
  std::int64_t read(std::span<std::uint8_t> bytes) override {
    return orError(
        retryInterrupted([&] { return ::read(file_.get(), bytes.data(), bytes.size()); }));
  }
  int control(unsigned long request, void* argument) override {
    return orError(retryInterrupted([&] { return ::ioctl(file_.get(), request, argument); }));
  }
  int pollServiceRequest() override {
    pollfd entry{file_.get(), POLLPRI, 0};
    const int ready = orError(retryInterrupted([&] { return ::poll(&entry, 1, 0); }));
    if (ready < 0) return ready;
    if ((entry.revents & (POLLHUP | POLLNVAL)) != 0) return -ENODEV;
    return (entry.revents & POLLPRI) != 0 ? 1 : 0;
  }

 private:
  const std::string path_;
  FileDescriptor file_;
};

}  // namespace

std::unique_ptr<UsbtmcFile> usbtmcDeviceFile(std::string path) {
  return std::make_unique<DeviceFile>(std::move(path));
}

}  // namespace mpf
