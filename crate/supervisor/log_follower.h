// SPDX-License-Identifier: MIT
// LogFollower: copies the lines that processes append to their logs to the stderr of the
// supervisor, each with the name of its process, and limits the size of the logs. Of lines that
// repeat, the first three are copied, and the others are counted if the count is shorter than they.
//
//   NAME.log ─ pread ─► "NAME | line"
//      ▲
//      └─ note(): starts and ends of the process
//
// Threads  one.
// Crash    the processes write to files, so they never wait for the supervisor.
// Trust    lines may contain anything; control characters are escaped.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>

#include <mpf/file_descriptor.h>

namespace mpf::crate {

// Lines of the supervisor in the log of a process begin with it.
inline constexpr const char* kNotePrefix = "-- ";
// A log is shortened by a multiple of this.
inline constexpr std::int64_t kLogBlockBytes = 65536;

// Counts repetitions of a line.
class LineFolder {
 public:
  // The text to print for a line: nothing if it repeats the lines before; a count of such lines
  // before a line that differs. Digits, as in times, do not count as differences.
  [[nodiscard]] std::string fold(const std::string& line);
  // What was not printed yet: the count of the repeated lines, or the lines if they are not longer.
  [[nodiscard]] std::string finish();

 private:
  [[nodiscard]] std::string countText() const;

  static constexpr int kMostPrinted = 3;
  std::string last_;  // without its digits
  int printed_ = 0;  // how often the last line came
  std::uint64_t folded_ = 0;
  std::string lines_;  // the folded ones, until they are longer than a count
};

class LogFollower {
 public:
  // A user has few inotify instances (128 by default) and watches. Without one, the descriptor does
  // not report all changes.
  //   hasColour  whether names are coloured
  //   maxBytes   of each log; the first half of a longer one is removed
  LogFollower(bool hasColour, std::uint64_t maxBytes);

  void setMaxBytes(std::uint64_t maxBytes) noexcept { maxBytes_ = maxBytes; }
  // Follows a log from its present end; it need not exist.
  //   throws  std::system_error; then it is not followed
  void add(const std::string& name, const std::string& path);
  // Appends a line to a log, such as "-- 2026-11-30 10:39:27 started, pid 18294", also if the
  // process has not ended its last line. takeLines() does not return it. Without space on the disk,
  // the line is missing.
  void note(const std::string& name, const std::string& text);
  // Readable when a log has grown; -1 without an inotify instance. Call takeLines() once a second,
  // too.
  [[nodiscard]] int descriptor() const noexcept { return events_.get(); }
  // Returns new lines, at most about a megabyte of each log; hasMore() tells whether others follow.
  // A line that is longer than 64 KiB comes in parts.
  [[nodiscard]] std::string takeLines();
  // Shortens logs that are too long, as takeLines() does, but takes no lines; follows the new file
  // of a log that was removed or renamed.
  void maintain();
  [[nodiscard]] bool hasMore() const noexcept { return hasMore_; }

 private:
  struct Log {
    std::string path;
    FileDescriptor file;
    int watch = -1;  // -1: the user has no watch left
    std::int64_t offset = 0;
    std::string partial;  // a line without its end
    std::deque<std::string> notes;  // lines of note() that were not read yet
    LineFolder folder;
  };
  [[nodiscard]] Log open(const std::string& path) const;
  [[nodiscard]] static bool isReplaced(const Log& log);
  void tryReopen(Log& log);
  void readBytes(Log& log);
  void readNew(const std::string& name, Log& log, std::string& to);
  static std::string takeWhole(Log& log);
  static bool takeNote(Log& log, const std::string& line);
  void limit(Log& log) const;
  [[nodiscard]] std::string prefix(const std::string& name) const;

  bool hasColour_;
  std::uint64_t maxBytes_;
  FileDescriptor events_;  // inotify
  std::map<std::string, Log> logs_;
  bool hasMore_ = false;
};

}  // namespace mpf::crate
