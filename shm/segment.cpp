// SPDX-License-Identifier: MIT
#include "shm/segment.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fmt/format.h>
#include <memory>

#include <mpf/clock.h>

#include "base/step.h"
#include "base/system_call.h"
#include "shm/owner_lock.h"
#include "shm/process.h"
#include "shm/reserve.h"
#include "shm/segment_name.h"

namespace mpf {
namespace {

constexpr const char* kDirectory = "/dev/shm";

// Any user may create any kind of file in /dev/shm. With O_NONBLOCK, open() does not wait if the
// file is a FIFO.
FileDescriptor openByName(const std::string& name, int flags) {
  return FileDescriptor(
      ::open(segments::path(name).c_str(), flags | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
}

// The rights of a file, for the message of a process that may not open it:
// " (mode 0600, user 0, group 0)".
std::string rightsInWords(const std::string& name) {
  struct stat status{};
  if (::lstat(segments::path(name).c_str(), &status) != 0) return {};
  return fmt::format(" (mode {:04o}, user {}, group {})", status.st_mode & 07777u, status.st_uid,
                     status.st_gid);
}

// Opens a regular file; empty if no file has this name. Throws as Segment::tryOpen.
FileDescriptor openRegular(const std::string& name, int flags, std::size_t& fileBytes) {
  const auto path = segments::path(name);
  auto file = openByName(name, flags);
  if (!file) {
    const int reason = errno;
    if (reason == ENOENT) return {};
    throwSystemError(reason, "open", path + (reason == EACCES ? rightsInWords(name) : ""));
  }
  struct stat status{};
  checkCall(::fstat(file.get(), &status), "read the status of", path);
  if (!S_ISREG(status.st_mode))
    throw SegmentError(fmt::format("{}: not a segment of MPF (not a regular file)", path));
  fileBytes = static_cast<std::size_t>(status.st_size);
  return file;
}

// Opens a segment and copies its header; empty if no file has this name.
// Throws as Segment::tryOpen.
FileDescriptor openChecked(const std::string& name, layout::SegmentKind kind, int flags,
                           layout::SegmentHeader& header) {
  std::size_t fileBytes = 0;
  auto file = openRegular(name, flags, fileBytes);
  if (!file) return {};
  const auto path = segments::path(name);
  if (fileBytes < layout::kHeaderBytes ||
      ::pread(file.get(), &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header)) {
    throw SegmentError(
        fmt::format("{}: truncated, {} bytes are too few for a header", path, fileBytes));
  }
  segments::check(header, fileBytes, kind, path);
  return file;
}

// Reads the header that names a file's owner. Returns an empty header if it cannot be trusted:
// every peer may overwrite the header of hints, and a file without our magic may be anything.
layout::SegmentHeader ownersHeader(int fd, const std::string& name) {
  layout::SegmentHeader header{};
  const auto parsed = SegmentName::tryParse(name);
  if (parsed && parsed->kind == NameKind::hints) return {};
  if (::pread(fd, &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header)) return {};
  return header.magic == layout::kMagic ? header : layout::SegmentHeader{};
}

bool isOwned(int fd, const std::string& name) {
  return owner_lock::isHeldByOwner(fd, ownersHeader(fd, name));
}

// Whether the name still refers to this regular file.
bool isNameOf(int fd, const std::string& name) noexcept {
  struct stat opened{};
  struct stat named{};
  if (::fstat(fd, &opened) != 0 || !S_ISREG(opened.st_mode)) return false;
  return ::stat(segments::pathText(name.c_str()).data(), &named) == 0 &&
         opened.st_ino == named.st_ino;
}

// Name of the reaper file for the segment that has this name now; empty if it has no reaper file.
std::string reaperFileOf(int fd, const std::string& name) {
  const auto parsed = SegmentName::tryParse(name);
  const auto header = ownersHeader(fd, name);
  if (!parsed || header.incarnation == 0) return {};
  return SegmentName::keyed(parsed->backplane, NameKind::reaper, header.incarnation);
}

// Whether a file is a segment, of any kind, that this program can use.
bool isKnown(int fd, const std::string& name) try {
  layout::SegmentHeader header{};
  struct stat status{};
  if (::fstat(fd, &status) != 0 ||
      ::pread(fd, &header, sizeof header, 0) != static_cast<ssize_t>(sizeof header))
    return false;
  segments::check(header, static_cast<std::size_t>(status.st_size), header.kind,
                  segments::path(name));
  return true;
} catch (const SegmentError&) {
  return false;
}

}  // namespace

void setRights(int fd, const Rights& rights) {
  constexpr auto kOwn = ~std::uint32_t{0};
  if (rights.group != kOwn)
    checkCall(::fchown(fd, kOwn, rights.group), "give a segment to group",
              std::to_string(rights.group));
  if (rights.user != kOwn)
    checkCall(::fchown(fd, rights.user, kOwn), "give a segment to user",
              std::to_string(rights.user));
  checkCall(::fchmod(fd, rights.mode), "set the mode of a segment");
}

Segment Segment::create(std::size_t bytes, layout::SegmentKind kind, std::string_view backplane,
                        Rights rights, std::size_t reservedBytes) {
  Segment segment;
  segment.file_.reset(checkCall(::open(kDirectory, O_TMPFILE | O_RDWR | O_CLOEXEC, 0600),
                                "create a segment in", kDirectory));
  const int fd = segment.file_.get();
  mpf::setRights(fd, rights);
  if (const int shortage = reserve(fd, reservedBytes); shortage != 0)
    throwSystemError(shortage, fmt::format("reserve {} bytes in", reservedBytes), kDirectory);
  if (reservedBytes < bytes)
    checkCall(::ftruncate(fd, static_cast<off_t>(bytes)), "set the length of a segment in",
              kDirectory);
  segment.mapping_ = Mapping(fd, bytes, Access::readWrite);

  auto& header = segment.sharedHeader();
  header.magic = layout::kMagic;
  header.layoutMajor = layout::kMajor;
  header.layoutMinor = layout::kMinor;
  header.kind = kind;
  header.totalBytes = bytes;
  header.incarnation = segments::newIncarnation();
  header.ownerWindow = header.incarnation;
  Process::self().describe(header);
  header.createdMonotonicNs = Clock::nowNs();
  header.createdRealtimeNs = Clock::wallNs();
  backplane.copy(header.backplane.data(), header.backplane.size() - 1);
  segment.header_ = header;
  MPF_STEP(segment_created);
  return segment;
}

FileDescriptor Segment::reopen() const noexcept try {
  auto file = openByName(name_, O_RDWR);
  std::uint64_t found = 0;
  const auto got =
      ::pread(file.get(), &found, sizeof found, offsetof(layout::SegmentHeader, incarnation));
  if (got != sizeof found || found != header_.incarnation) return {};
  return file;
} catch (const std::bad_alloc&) {
  return {};
}

bool Segment::tryReserve() const noexcept {
  const auto file = reopen();
  return file && reserve(file.get(), bytes()) == 0;
}

bool Segment::tryRelease(std::size_t from) const noexcept {
  const auto file = reopen();
  return file && ::fallocate(file.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE,
                             static_cast<off_t>(from), static_cast<off_t>(bytes() - from)) == 0;
}

void Segment::lockForLife() {
  if (!owner_lock::trySet(file_.get())) throwSystemError(errno, "lock the new segment", name_);
  mapping_.growBy(file_.get());
}

bool Segment::tryPublish(const std::string& name) {
  completeHeader();
  auto ownName = name;  // here, because nothing may fail after the file has its name
  MPF_STEP(segment_complete);
  const auto self = fmt::format("/proc/self/fd/{}", file_.get());
  if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, segments::path(name).c_str(), AT_SYMLINK_FOLLOW) ==
      0) {
    MPF_STEP(segment_named);
    name_ = std::move(ownName);
    return true;
  }
  if (errno == EEXIST) return false;
  throwSystemError(errno, "name a segment", segments::path(name));
}

std::uint32_t Segment::fileUser() const noexcept {
  struct stat status{};
  return ::fstat(file_.get(), &status) == 0 ? status.st_uid : ~std::uint32_t{0};
}

bool Segment::hasName() const noexcept { return isNameOf(file_.get(), name_); }

bool Segment::isLocked() const noexcept { return owner_lock::isHeld(file_.get()); }

bool Segment::hasOwner() const noexcept { return owner_lock::isHeldByOwner(file_.get(), header_); }

std::optional<Segment> Segment::tryOpen(const std::string& name, layout::SegmentKind kind,
                                        Access access) {
  Segment segment;
  segment.name_ = name;
  segment.file_ =
      openChecked(name, kind, access == Access::readWrite ? O_RDWR : O_RDONLY, segment.header_);
  if (!segment.file_) return std::nullopt;
  segment.mapping_ = Mapping(segment.file_.get(), segment.header_.totalBytes, access);
  return segment;
}

std::optional<Segment> Segment::tryOpenShared(const std::string& name, std::size_t bytes) {
  Segment segment;
  segment.name_ = name;
  std::size_t fileBytes = 0;
  segment.file_ = openRegular(name, O_RDWR, fileBytes);
  if (!segment.file_) return std::nullopt;
  const int file = segment.file_.get();
  if (fileBytes < bytes && (!owner_lock::isHeld(file) || reserve(file, bytes) != 0))
    throw SegmentError(
        fmt::format("{}: truncated, {} bytes of {}", segments::path(name), fileBytes, bytes));
  segment.mapping_ = Mapping(file, bytes, Access::readWrite);
  segment.mapping_.growAt(file, segments::path(name));
  return segment;
}

namespace segments {

std::string path(const std::string& name) { return fmt::format("{}/{}", kDirectory, name); }

PathText pathText(const char* name) noexcept {
  PathText text{};
  fmt::format_to_n(text.data(), text.size() - 1, "{}/{}", kDirectory, name);
  return text;
}

bool remove(const char* name) noexcept {
  const bool removed = ::shm_unlink(name) == 0;
  MPF_STEP(name_removed);
  return removed;
}

bool exists(const char* name) noexcept { return ::access(pathText(name).data(), F_OK) == 0; }

void check(const layout::SegmentHeader& header, std::size_t fileBytes, layout::SegmentKind kind,
           const std::string& path) {
  if (header.magic != layout::kMagic)
    throw SegmentError(fmt::format("{}: not a segment of MPF (wrong magic number)", path));
  // Before the version: the kind is at the same place in all versions, so a header with another one
  // is spoiled, not of another version.
  if (header.kind != kind) {
    throw SegmentError(fmt::format("{}: a segment of kind {}, expected kind {}", path,
                                   static_cast<std::uint32_t>(header.kind),
                                   static_cast<std::uint32_t>(kind)));
  }
  if (header.layoutMajor < layout::kOldestMajor || header.layoutMajor > layout::kMajor) {
    const auto supported = layout::kOldestMajor == layout::kMajor
                               ? fmt::to_string(layout::kMajor)
                               : fmt::format("{} to {}", layout::kOldestMajor, layout::kMajor);
    throw VersionError(
        fmt::format("{}: layout version {}; this program supports {}; restart all processes of the "
                    "backplane with the same release of MPF",
                    path, header.layoutMajor, supported));
  }
  if (header.totalBytes < layout::kHeaderBytes || fileBytes < header.totalBytes) {
    throw SegmentError(
        fmt::format("{}: truncated, {} bytes of {}", path, fileBytes, header.totalBytes));
  }
}

std::optional<layout::SegmentHeader> tryReadHeader(const std::string& name,
                                                   layout::SegmentKind kind) {
  layout::SegmentHeader header{};
  if (!openChecked(name, kind, O_RDONLY, header)) return std::nullopt;
  return header;
}

std::optional<Probed> tryProbe(const std::string& name, layout::SegmentKind kind) {
  Probed probed{};
  const auto file = openChecked(name, kind, O_RDONLY, probed.header);
  if (!file) return std::nullopt;
  struct stat status{};
  checkCall(::fstat(file.get(), &status), "read the status of", path(name));
  probed.user = status.st_uid;
  probed.isLocked = owner_lock::isHeld(file.get());
  probed.hasOwner = probed.isLocked && !Process::hasEnded(probed.header);
  return probed;
}

std::optional<std::uint32_t> userOf(const std::string& name) {
  struct stat status{};
  if (::lstat(path(name).c_str(), &status) != 0) return std::nullopt;
  return status.st_uid;
}

Owner probeOwner(const std::string& name, std::uint64_t incarnation) {
  const auto file = openByName(name, O_RDONLY);
  // A file that we cannot open may have a living owner.
  if (!file) return errno == ENOENT ? Owner::absent : Owner::alive;
  if (incarnation != 0) {
    std::uint64_t found = 0;
    const auto got =
        ::pread(file.get(), &found, sizeof found, offsetof(layout::SegmentHeader, incarnation));
    if (got != sizeof found || found != incarnation) return Owner::absent;
  }
  return isOwned(file.get(), name) ? Owner::alive : Owner::dead;
}

bool haveSameUser(const std::string& one, const std::string& other) {
  const auto user = userOf(one);
  return user && user == userOf(other);
}

bool isLocked(const std::string& name) {
  const auto file = openByName(name, O_RDONLY);
  return file && owner_lock::isHeld(file.get());
}

bool removeIfOwnerless(const std::string& name) {
  const auto file = openByName(name, O_RDWR);
  if (!file || isOwned(file.get(), name)) return false;
  const owner_lock::Reaper reaper(file, reaperFileOf(file.get(), name));
  if (!reaper.mayRemove()) return false;
  MPF_STEP(reclaim_locked);
  // From here on no other process removes the name of this file. Check that the name still refers
  // to this file.
  if (!isNameOf(file.get(), name)) return false;
  // A free lock proves nothing unless the file is a segment of a known version.
  if (!isKnown(file.get(), name)) return false;
  MPF_STEP(reclaim_proved);
  return remove(name);
}

// Needs no lock: no other file will ever have this name, and a second removal finds no file.
bool removeKeyedIfOwnerless(const std::string& name) {
  const auto file = openByName(name, O_RDONLY);
  if (!file || isOwned(file.get(), name) || !isNameOf(file.get(), name)) return false;
  MPF_STEP(reclaim_proved);
  return remove(name);
}

std::vector<std::string> list(const std::string& prefix) {
  std::vector<std::string> names;
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(::opendir(kDirectory),
                                                      [](DIR* open) { return ::closedir(open); });
  if (!directory) throwSystemError(errno, "list", kDirectory);
  while (const auto* entry = ::readdir(directory.get())) {
    if (std::strncmp(entry->d_name, prefix.c_str(), prefix.size()) == 0)
      names.emplace_back(entry->d_name);
  }
  return names;
}

std::uint64_t newIncarnation() {
  std::uint64_t incarnation = 0;
  while (incarnation == 0) {
    checkCall(retryInterrupted([&] { return ::getrandom(&incarnation, sizeof incarnation, 0); }),
              "getrandom");
  }
  return incarnation;
}

}  // namespace segments
}  // namespace mpf
