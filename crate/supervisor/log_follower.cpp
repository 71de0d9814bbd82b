// SPDX-License-Identifier: MIT
#include "crate/supervisor/log_follower.h"

#include <fcntl.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <functional>
#include <system_error>
#include <utility>

#include "base/printable.h"
#include "base/system_call.h"

namespace mpf::crate {
namespace {

constexpr std::int64_t kMostAtOnce = std::int64_t{1} << 20;
constexpr std::size_t kLongestLine = std::size_t{64} << 10;

// Digits are what differs between the lines of a storm: times, counts, addresses.
std::string withoutNumbers(const std::string& line) {
  std::string text;
  for (const char one : line)
    if (std::isdigit(static_cast<unsigned char>(one)) == 0) text += one;
  return text;
}

// Whether the next byte of the file begins a line.
bool isAtLineStart(const FileDescriptor& file) {
  struct stat status{};
  char last = '\n';
  if (::fstat(file.get(), &status) == 0 && status.st_size != 0)
    static_cast<void>(::pread(file.get(), &last, 1, status.st_size - 1));
  return last == '\n';
}

}  // namespace

std::string LineFolder::fold(const std::string& line) {
  auto bare = withoutNumbers(line);
  if (bare == last_ && ++printed_ > kMostPrinted) {
    ++folded_;
    if (lines_.size() <= countText().size()) lines_ += line + "\n";
    return {};
  }
  auto text = finish();
  if (bare != last_) printed_ = 1;
  last_ = std::move(bare);
  return text + line + "\n";
}

std::string LineFolder::finish() {
  if (folded_ == 0) return {};
  const auto count = countText();
  folded_ = 0;
  auto lines = std::exchange(lines_, {});
  return lines.size() <= count.size() ? lines : count;
}

std::string LineFolder::countText() const {
  return folded_ == 1 ? "(repeated once more)\n" : fmt::format("(repeated {} times)\n", folded_);
}

LogFollower::LogFollower(bool hasColour, std::uint64_t maxBytes)
    : hasColour_(hasColour),
      maxBytes_(maxBytes),
      events_(::inotify_init1(IN_CLOEXEC | IN_NONBLOCK)) {}

void LogFollower::add(const std::string& name, const std::string& path) {
  if (logs_.contains(name)) return;
  auto log = open(path);
  log.offset = ::lseek(log.file.get(), 0, SEEK_END);
  logs_.emplace(name, std::move(log));
}

LogFollower::Log LogFollower::open(const std::string& path) const {
  Log log;
  log.path = path;
  log.file = FileDescriptor(
      checkCall(::open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0600), "open", path));
  log.watch = ::inotify_add_watch(events_.get(), path.c_str(), IN_MODIFY);
  return log;
}

void LogFollower::note(const std::string& name, const std::string& text) {
  const auto found = logs_.find(name);
  if (found == logs_.end()) return;
  auto& log = found->second;
  if (isReplaced(log)) tryReopen(log);
  const auto line =
      fmt::format("{}{:%F %T} {}", kNotePrefix, fmt::localtime(std::time(nullptr)), text);
  const auto bytes = (isAtLineStart(log.file) ? "" : "\n") + line + "\n";
  if (::write(log.file.get(), bytes.data(), bytes.size()) > 0) log.notes.push_back(line);
}

std::string LogFollower::takeLines() {
  std::array<char, 4096> events{};
  while (::read(events_.get(), events.data(), events.size()) > 0) continue;
  std::string text;
  hasMore_ = false;
  for (auto& [name, log] : logs_) readNew(name, log, text);
  for (auto& [name, log] : logs_) limit(log);
  return text;
}

void LogFollower::maintain() {
  for (auto& [name, log] : logs_) {
    if (isReplaced(log)) tryReopen(log);
    limit(log);
  }
}

bool LogFollower::isReplaced(const Log& log) {
  struct stat opened{}, named{};
  return ::fstat(log.file.get(), &opened) == 0 && ::stat(log.path.c_str(), &named) == 0 &&
         (opened.st_ino != named.st_ino || opened.st_dev != named.st_dev);
}

// Takes the rest of the old file, and follows the new one from its beginning. Without a free
// descriptor, the next call tries again.
void LogFollower::tryReopen(Log& log) try {
  auto fresh = open(log.path);
  readBytes(log);
  ::inotify_rm_watch(events_.get(), log.watch);
  log.file = std::move(fresh.file);
  log.watch = fresh.watch;
  log.offset = 0;
  hasMore_ = true;
} catch (const std::system_error&) {
  return;
}

std::string LogFollower::prefix(const std::string& name) const {
  if (!hasColour_) return name + " | ";
  const auto colour = 31 + std::hash<std::string>()(name) % 6;
  return fmt::format("\x1b[{}m{}\x1b[0m | ", colour, name);
}

void LogFollower::readBytes(Log& log) {
  std::array<char, 65536> bytes{};
  struct stat status{};
  if (::fstat(log.file.get(), &status) == 0 && status.st_size < log.offset) log.offset = 0;
  const auto enough = log.offset + kMostAtOnce;
  while (log.offset < enough) {
    const auto length = ::pread(log.file.get(), bytes.data(), bytes.size(), log.offset);
    if (length <= 0) break;
    log.offset += length;
    log.partial.append(bytes.data(), static_cast<std::size_t>(length));
  }
  hasMore_ = hasMore_ || log.offset >= enough;
}

void LogFollower::readNew(const std::string& name, Log& log, std::string& to) {
  readBytes(log);
  const auto folded = takeWhole(log);
  for (std::size_t begin = 0; begin < folded.size();) {
    const auto end = folded.find('\n', begin);
    to += prefix(name) + folded.substr(begin, end - begin + 1);
    begin = end + 1;
  }
}

// Takes the lines that have an end, and a part of one that is very long.
std::string LogFollower::takeWhole(Log& log) {
  std::string folded;
  std::size_t begin = 0;
  for (auto end = log.partial.find('\n'); end != std::string::npos;
       end = log.partial.find('\n', begin)) {
    const auto line = log.partial.substr(begin, end - begin);
    if (!takeNote(log, line)) folded += log.folder.fold(printable(line));
    begin = end + 1;
  }
  log.partial.erase(0, begin);
  if (log.partial.size() > kLongestLine)
    folded += log.folder.fold(printable(std::exchange(log.partial, {})));
  return folded + log.folder.finish();
}

bool LogFollower::takeNote(Log& log, const std::string& line) {
  const auto found = std::ranges::find(log.notes, line);
  if (found == log.notes.end()) return false;
  log.notes.erase(log.notes.begin(), std::next(found));
  return true;
}

// Removes the first half of a log that is too long. The file system removes it as a whole, so no
// line that is written meanwhile is lost; where it cannot (tmpfs), the log begins with a hole.
void LogFollower::limit(Log& log) const {
  struct stat status{};
  if (::fstat(log.file.get(), &status) != 0) return;
  const auto bytes = std::min<std::int64_t>(status.st_size, status.st_blocks * 512);
  if (bytes <= static_cast<std::int64_t>(maxBytes_)) return;
  const auto removed = (status.st_size - bytes / 2) / kLogBlockBytes * kLogBlockBytes;
  if (removed == 0) return;
  const auto isUnread = log.offset < removed;
  if (::fallocate(log.file.get(), FALLOC_FL_COLLAPSE_RANGE, 0, removed) == 0)
    log.offset = std::max<std::int64_t>(log.offset - removed, 0);
  else if (::fallocate(log.file.get(), FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, removed) == 0)
    log.offset = std::max<std::int64_t>(log.offset, removed);  // it does not read the hole
  else return;
  if (isUnread && !log.partial.empty()) log.partial += '\n';  // the rest of this line was removed
}

}  // namespace mpf::crate
