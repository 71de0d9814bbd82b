// SPDX-License-Identifier: MIT
#include "server/programs/server_log.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <spdlog/logger.h>
#include <thread>
#include <utility>

#include <mpf/message_server.h>

#include "base/signals_blocked.h"
#include "server/programs/printable_sink.h"

namespace mpf {
namespace {

constexpr std::size_t kMaxQueuedLines = 1024;

}  // namespace

// The queue, and the thread that empties it.
class ServerLog::Writer {
 public:
  explicit Writer(const std::string& program)
      : logger_(program, std::make_shared<PrintableSink>()) {
    logger_.set_level(Log::Level::trace);
    logger_.set_pattern("%Y-%m-%d %H:%M:%S.%e %l %n: %v");
  }

  void start(const Log& log) {
    const SignalsBlocked blocked;
    thread_ = std::thread([this, log] { run(log); });
  }
  // Returns when the queue is empty.
  void finish() {
    {
      const std::scoped_lock guard(lock_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }

  void add(Log::Level level, std::string text) noexcept try {
    {
      const std::scoped_lock guard(lock_);
      if (queue_.size() == kMaxQueuedLines) {
        queue_.pop_front();
        ++dropped_;
      }
      queue_.push_back({spdlog::log_clock::now(), level, std::move(text)});
    }
    changed_.notify_one();
    // NOLINTNEXTLINE(bugprone-empty-catch): no memory: the line is lost, the program continues
  } catch (...) {
  }

  void wakeAt(std::int64_t dueNs) noexcept {
    {
      const std::scoped_lock guard(lock_);
      dueNs_ = std::min(dueNs_, dueNs);
    }
    changed_.notify_one();
  }

 private:
  struct Line {
    spdlog::log_clock::time_point time;
    Log::Level level;
    std::string text;
  };

  void run(const Log& log) {
    std::unique_lock guard(lock_);
    for (;;) {
      if (!queue_.empty()) {
        writeQueue(guard);
      } else if (ends_) {
        return;
      } else if (dueNs_ <= Clock::nowNs()) {
        dueNs_ = INT64_MAX;
        guard.unlock();
        const auto nextNs = tryWriteDue(log);
        guard.lock();
        dueNs_ = std::min(dueNs_, nextNs);
      } else if (dueNs_ == INT64_MAX) {
        changed_.wait(guard);
      } else {
        changed_.wait_for(guard, Deadline::atNs(dueNs_).left());
      }
    }
  }

  // Without memory, some lines may be lost; those that are still held follow later.
  static std::int64_t tryWriteDue(const Log& log) noexcept try {
    return log.writeDue();
  } catch (const std::exception&) {
    return Deadline::after(std::chrono::seconds(1)).ns();
  }

  // Needs no memory: the two queues take turns.
  void writeQueue(std::unique_lock<std::mutex>& guard) {
    written_.swap(queue_);
    const auto dropped = std::exchange(dropped_, 0);
    guard.unlock();
    if (dropped != 0)
      logger_.warn("{} lines are missing here: stderr was not read in time", dropped);
    for (const auto& line : written_)
      logger_.log(line.time, spdlog::source_loc{}, line.level, line.text);
    written_.clear();
    guard.lock();
  }

  spdlog::logger logger_;
  std::mutex lock_;
  std::condition_variable changed_;
  std::deque<Line> queue_;
  std::deque<Line> written_;  // of the thread; empty unless it writes
  std::uint64_t dropped_ = 0;
  std::int64_t dueNs_ = INT64_MAX;  // when the limit has lines to write
  bool ends_ = false;
  std::thread thread_;
};

// A Log that outlives this object keeps the queue alive, but its lines are no longer written.
ServerLog::ServerLog(const std::string& program, const std::string& level)
    : writer_(std::make_shared<Writer>(program)),
      log_(
          [writer = writer_](Log::Level of, std::string text) { writer->add(of, std::move(text)); },
          spdlog::level::from_str(level)) {
  log_.onHeld([writer = writer_](std::int64_t dueNs) { writer->wakeAt(dueNs); });
  writer_->start(log_);
}

ServerLog::~ServerLog() {
  try {
    log_.writeHeld();
    // NOLINTNEXTLINE(bugprone-empty-catch): no memory: the lines are lost, the program ends in order
  } catch (const std::exception&) {
  }
  writer_->finish();
}

void logShortages(MessageServer& server, const Log& log) {
  server.onShortage([log, name = server.getName()](const std::string& why) {
    if (why.empty()) log.info(R"("{}" accepts clients again)", name);
    else log.warn(R"("{}" cannot accept another client: {})", name, why);
  });
}

const std::vector<std::string>& ServerLog::levels() {
  static const std::vector<std::string> names{"trace", "debug",    "info", "warning",
                                              "error", "critical", "off"};
  return names;
}

}  // namespace mpf
