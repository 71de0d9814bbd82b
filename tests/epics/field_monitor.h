// SPDX-License-Identifier: MIT
// FieldMonitor: the events that the IOC posts for one field.
//
//   FieldMonitor monitor("lab:bits.RVAL");
//   Ioc::put("lab:bits.PROC", "1");
//   EXPECT_THAT(monitor.takeMasks(), ElementsAre(DBE_VALUE | DBE_LOG));
//
// Threads  takeMasks() is called by one thread; the IOC calls onEvent() in a thread of its own.
#pragma once

#include <caeventmask.h>
#include <condition_variable>
#include <dbChannel.h>
#include <dbEvent.h>
#include <db_field_log.h>
#include <gtest/gtest.h>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace mpf::test {

class FieldMonitor {
 public:
  // The IOC must run until the monitor is destroyed.
  explicit FieldMonitor(const std::string& field)
      : channel_(dbChannelCreate(field.c_str())), events_(db_init_events()) {
    EXPECT_EQ(dbChannelOpen(channel_), 0) << field;
    db_start_events(events_, "field monitor", nullptr, nullptr, epicsThreadPriorityCAServerLow);
    subscription_ = db_add_event(events_, channel_, onEvent, this, DBE_VALUE | DBE_LOG | DBE_ALARM);
    marker_ = db_add_event(events_, channel_, onMarker, this, DBE_PROPERTY);
    db_event_enable(subscription_);
  }
  ~FieldMonitor() {
    db_cancel_event(marker_);
    db_cancel_event(subscription_);
    db_close_events(events_);
    dbChannelDelete(channel_);
  }
  FieldMonitor(const FieldMonitor&) = delete;
  FieldMonitor& operator=(const FieldMonitor&) = delete;

  // The masks (DBE_VALUE, DBE_LOG, DBE_ALARM) of all events since the last call, in order.
  std::vector<unsigned> takeMasks() {
    db_post_single_event(marker_);  // both subscriptions share a queue, so it arrives last
    std::unique_lock lock(mutex_);
    came_.wait(lock, [this] { return isMarked_; });
    isMarked_ = false;
    return std::exchange(masks_, {});
  }

 private:
  static void onEvent(void* self, dbChannel* /*channel*/, int /*remaining*/, db_field_log* event) {
    auto& monitor = *static_cast<FieldMonitor*>(self);
    const std::lock_guard lock(monitor.mutex_);
    monitor.masks_.push_back(event->mask);
  }
  static void onMarker(void* self, dbChannel* /*channel*/, int /*remaining*/, db_field_log*) {
    auto& monitor = *static_cast<FieldMonitor*>(self);
    const std::lock_guard lock(monitor.mutex_);
    monitor.isMarked_ = true;
    monitor.came_.notify_one();
  }

  dbChannel* channel_;
  dbEventCtx events_;
  dbEventSubscription subscription_;
  dbEventSubscription marker_;
  std::mutex mutex_;
  std::condition_variable came_;
  std::vector<unsigned> masks_;  // under mutex_, as the next
  bool isMarked_ = false;
};

}  // namespace mpf::test
