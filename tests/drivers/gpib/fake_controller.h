// SPDX-License-Identifier: MIT
// FakeController: a GPIB controller with an instrument at every address. An instrument answers with
// the last bytes that were written to it, and keeps them, so that a read shows which write came
// before it.
//
//   FakeGpib fake;                          // what the test sets and sees; outlives the bus
//   GpibBus bus(fake.makeController());
//   fake.hang({5});                         // operations with 5 last until their deadline
//
// Threads  any.
#pragma once

#include <atomic>
#include <condition_variable>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <mpf/drivers/gpib/gpib_controller.h>

#include "tests/drivers/gpib/echo_instrument.h"

namespace mpf::test {

inline std::vector<std::uint8_t> bytesOf(std::string_view text) {
  return {text.begin(), text.end()};
}

class FakeGpib {
 public:
  [[nodiscard]] std::unique_ptr<GpibController> makeController();

  // Operations with this address last until their deadline, or until letGo().
  void hang(GpibAddress at) {
    const std::lock_guard lock(mutex_);
    hanging_.insert(at);
  }
  void letGo() {
    const std::lock_guard lock(mutex_);
    hanging_.clear();
    changed_.notify_all();
  }
  // Waits until an operation hangs.
  void waitForHanging() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return hangs_ > 0; });
  }
  // The status byte that a serial poll returns once; with kGpibRequestsService it activates SRQ.
  void setStatus(GpibAddress at, std::uint8_t status) {
    std::function<void()> report;
    {
      const std::lock_guard lock(mutex_);
      statuses_[at] = status;
      if (reportsItself && (status & kGpibRequestsService) != 0) report = onRequest_;
    }
    if (report) report();
  }
  // All operations in their order, as "write 5", "read 5", "clear all".
  [[nodiscard]] std::vector<std::string> operations() const {
    const std::lock_guard lock(mutex_);
    return operations_;
  }
  [[nodiscard]] bool isPeeking() const {
    const std::lock_guard lock(mutex_);
    return static_cast<bool>(peek_);
  }

  bool reportsItself = true;  // service requests; to be set before the bus exists
  GpibResult startResult{};  // of interfaceClear()
  std::atomic<int> linePolls{0};  // calls of requestsService()

 private:
  friend class FakeController;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::set<GpibAddress> hanging_;
  int hangs_ = 0;
  std::map<GpibAddress, std::uint8_t> statuses_;
  std::map<GpibAddress, std::vector<std::uint8_t>> written_;
  std::vector<std::string> operations_;
  std::function<void()> onRequest_;
  GpibPeekHandler peek_;
};

class FakeController final : public GpibController {
 public:
  explicit FakeController(FakeGpib& fake) : fake_(fake) {}

  GpibResult write(const GpibAddress& to, Bytes data, bool sendEnd, Deadline deadline) override {
    const Operation operation(*this, "write", to);
    if (auto hung = tryHang(to, deadline)) return *hung;
    fake_.written_[to].assign(data.begin(), data.end());
    show(data, GpibDirection::sent, sendEnd);
    return {};
  }
  GpibReadResult read(const GpibAddress& from, const GpibReadLimits& limits,
                      Deadline deadline) override {
    const Operation operation(*this, "read", from);
    GpibReadResult result;
    if (auto hung = tryHang(from, deadline)) {
      static_cast<GpibResult&>(result) = *hung;
      return result;
    }
    auto rest = Bytes(fake_.written_[from]);
    result.sawEnd = rest.size() <= limits.maxBytes;
    rest = rest.first(std::min(rest.size(), limits.maxBytes));
    for (const auto byte : rest) {
      result.data.push_back(byte);
      if (byte != limits.endOfString) continue;
      result.sawEnd = false;
      break;
    }
    show(result.data, GpibDirection::received, result.sawEnd);
    return result;
  }
  GpibResult sendCommands(Bytes commands, Deadline) override {
    const Operation operation(*this, "commands " + textOf(commands));
    return {};
  }
  GpibPollResult serialPoll(const GpibAddress& at, Deadline deadline) override {
    const Operation operation(*this, "poll", at);
    if (auto hung = tryHang(at, deadline)) return {*hung, 0};
    const std::lock_guard lock(fake_.mutex_);
    return {{}, std::exchange(fake_.statuses_[at], std::uint8_t{0})};
  }
  GpibResult clearAll(Deadline) override {
    const Operation operation(*this, "clear all");
    return {};
  }
  GpibResult clear(const GpibAddress& at, Deadline deadline) override {
    const Operation operation(*this, "clear", at);
    return tryHang(at, deadline).value_or(GpibResult{});
  }
  GpibResult trigger(std::span<const GpibAddress> at, Deadline) override {
    std::string text = "trigger";
    for (const auto& address : at) text += " " + std::to_string(address.number());
    const Operation operation(*this, text);
    return {};
  }
  GpibResult interfaceClear(Deadline) override {
    const Operation operation(*this, "interface clear");
    return fake_.startResult;
  }
  GpibResult remoteEnable(bool on, Deadline) override {
    const Operation operation(*this, on ? "remote on" : "remote off");
    return {};
  }
  GpibResult localLockout(Deadline) override {
    const Operation operation(*this, "lockout");
    return {GpibStatus::unsupported, "the fake has no lockout"};
  }
  GpibResult goToLocal(const GpibAddress& at, Deadline) override {
    const Operation operation(*this, "local", at);
    return {GpibStatus::noListener, "nobody is there"};
  }
  std::optional<bool> requestsService(Deadline) override {
    const Use use(*this);
    ++fake_.linePolls;
    const std::lock_guard lock(fake_.mutex_);
    for (const auto& [at, status] : fake_.statuses_)
      if ((status & kGpibRequestsService) != 0) return true;
    return false;
  }
  bool onServiceRequest(std::function<void()> handler) override {
    const std::lock_guard lock(fake_.mutex_);
    fake_.onRequest_ = std::move(handler);
    return fake_.reportsItself;
  }
  void onPeek(GpibPeekHandler handler) override {
    const Use use(*this);
    const std::lock_guard lock(fake_.mutex_);
    fake_.peek_ = std::move(handler);
  }
  [[nodiscard]] std::string description() const override { return "fake controller"; }

 private:
  // One use at a time.
  class Use {
   public:
    explicit Use(FakeController& owner) : owner_(owner) {
      EXPECT_FALSE(owner_.isUsed_.exchange(true)) << "two operations at a time";
    }
    ~Use() { owner_.isUsed_ = false; }
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    FakeController& owner_;
  };
  class Operation {
   public:
    Operation(FakeController& owner, std::string text) : use_(owner) {
      const std::lock_guard lock(owner.fake_.mutex_);
      owner.fake_.operations_.push_back(std::move(text));
    }
    Operation(FakeController& owner, const std::string& what, const GpibAddress& at)
        : Operation(owner, what + " " + std::to_string(at.number())) {}

   private:
    Use use_;
  };

  std::optional<GpibResult> tryHang(const GpibAddress& at, Deadline deadline) {
    std::unique_lock lock(fake_.mutex_);
    if (!fake_.hanging_.contains(at)) return std::nullopt;
    ++fake_.hangs_;
    fake_.changed_.notify_all();
    while (fake_.hanging_.contains(at) && !deadline.hasPassed()) {
      if (deadline.isNever()) fake_.changed_.wait(lock);
      else fake_.changed_.wait_for(lock, deadline.left());
    }
    --fake_.hangs_;
    return GpibResult{GpibStatus::timeout, "the instrument hangs"};
  }
  void show(Bytes data, GpibDirection direction, bool withEnd) {
    std::vector<GpibPeekedByte> bytes;
    for (const auto value : data) bytes.push_back({Clock::nowNs(), value, false, false, direction});
    if (!bytes.empty()) bytes.back().endOrIdentify = withEnd;
    GpibPeekHandler peek;
    {
      const std::lock_guard lock(fake_.mutex_);
      peek = fake_.peek_;
    }
    if (peek && !bytes.empty()) peek(bytes);
  }

  FakeGpib& fake_;
  std::atomic<bool> isUsed_{false};
};

inline std::unique_ptr<GpibController> FakeGpib::makeController() {
  return std::make_unique<FakeController>(*this);
}

}  // namespace mpf::test
