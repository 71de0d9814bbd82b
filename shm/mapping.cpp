// SPDX-License-Identifier: MIT
#include "shm/mapping.h"

#include <sys/mman.h>

#include <boost/interprocess/shared_memory_object.hpp>
#include <fmt/format.h>
#include <utility>

#include "base/system_call.h"

namespace mpf {
namespace {

namespace ipc = boost::interprocess;

// Adapts an open file to Boost.Interprocess, which can then map it.
class OpenFile {
 public:
  explicit OpenFile(int fd) { handle_.handle = fd; }
  [[nodiscard]] auto get_mapping_handle() const { return handle_; }
  [[nodiscard]] ipc::mode_t get_mode() const { return ipc::read_write; }

 private:
  decltype(std::declval<ipc::shared_memory_object>().get_mapping_handle()) handle_{};
};

ipc::mode_t modeOf(Mapping::Access access) {
  switch (access) {
    case Mapping::Access::readOnly:
      return ipc::read_only;
    case Mapping::Access::readWrite:
      return ipc::read_write;
    case Mapping::Access::copyOnWrite:
      return ipc::copy_on_write;
  }
  return ipc::invalid_mode;
}

ipc::mapped_region mapRegion(int file, std::size_t bytes, Mapping::Access access) try {
  // Private copies exist only of pages that are written: reserve no memory for the others.
  const auto options =
      access == Mapping::Access::copyOnWrite ? MAP_NORESERVE : ipc::default_map_options;
  return {OpenFile(file), modeOf(access), 0, bytes, nullptr, options};
} catch (const ipc::interprocess_exception& error) {
  throwSystemError(error.get_native_error(), fmt::format("map {} bytes of a segment", bytes), {});
}

}  // namespace

Mapping::Mapping(int file, std::size_t bytes, Access access)
    : region_(mapRegion(file, bytes, access)),
      range_(
          fault_guard::add(region_.get_address(), region_.get_size(), access != Access::readOnly)),
      lost_(&fault_guard::lossOf(*range_)) {}

Mapping::Mapping(Mapping&& other) noexcept
    : region_(std::move(other.region_)),
      range_(std::exchange(other.range_, nullptr)),
      lost_(std::exchange(other.lost_, nullptr)) {}

Mapping& Mapping::operator=(Mapping&& other) noexcept {
  unguard();
  region_ = std::move(other.region_);
  range_ = std::exchange(other.range_, nullptr);
  lost_ = std::exchange(other.lost_, nullptr);
  return *this;
}

void Mapping::unguard() noexcept {
  if (range_ != nullptr) fault_guard::remove(std::exchange(range_, nullptr));
}

}  // namespace mpf
