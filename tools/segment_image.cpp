// SPDX-License-Identifier: MIT
#include <mpf/tools/segment_image.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/format.h>

#include <mpf/base/file_descriptor.h>
#include <mpf/base/system_call.h>
#include <mpf/shm/segment.h>

namespace mpf::tools {

std::optional<SegmentImage> SegmentImage::tryRead(const std::string& name, layout::SegmentKind kind, std::size_t bytes) {
  const auto path = segments::path(name);
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!file) {
    if (errno == ENOENT) return std::nullopt;
    throwSystemError(errno, "open", path);
  }
  struct stat status{};
  checkCall(::fstat(file.get(), &status), "look at", path);
  if (!S_ISREG(status.st_mode)) throw SegmentError(fmt::format("{}: not a segment of MPF (no plain file)", path));

  SegmentImage image;
  image.fileBytes_ = static_cast<std::uint64_t>(status.st_size);
  image.blocks_ = std::make_unique<Block[]>((bytes + sizeof(Block) - 1) / sizeof(Block));
  const auto got = checkCall(::pread(file.get(), image.blocks_.get(), bytes, 0), "read", path);
  if (static_cast<std::size_t>(got) < sizeof(layout::SegmentHeader)) {
    throw SegmentError(fmt::format("{}: truncated, {} bytes are too few for a header", path, got));
  }
  segments::check(image.header(), image.fileBytes_, kind, path);
  return image;
}

}  // namespace mpf::tools
